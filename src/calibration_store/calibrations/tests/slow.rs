//! Files and stores that take long.

use std::{
    fs,
    path::Path,
    sync::{
        atomic::{AtomicUsize, Ordering},
        mpsc::{Receiver, SyncSender},
    },
};

use super::{content, revision};
use crate::calibration_store::{
    FolderStore, ListedFile, Replaces,
    calibrations::{content::cameras, *},
};

/// Reading of files of which those named `slow…` end with `release`.
struct SlowFiles {
    reader: FileReader,
    release: SyncSender<()>,
    begun: Arc<AtomicUsize>,
}

fn slow_files(time_limit: Duration) -> SlowFiles {
    let (release, released): (_, Receiver<()>) = sync_channel(0);
    let released = Mutex::new(released);
    let begun = Arc::new(AtomicUsize::new(0));
    let count = Arc::clone(&begun);
    let reader = FileReader::new(time_limit, move |stem, name, content| {
        if name.starts_with("slow") {
            count.fetch_add(1, Ordering::Relaxed);
            // Ends at the latest with the test.
            let _ = released.lock().recv();
        }
        cameras(stem, name, content)
    });
    SlowFiles {
        reader,
        release,
        begun,
    }
}

const LONG: Duration = Duration::from_mins(1);
const SHORT: Duration = Duration::from_millis(400);

fn open_slow(folder: &Path, reader: FileReader, timeout: Duration) -> Arc<Calibrations> {
    let store = Box::new(FolderStore::new(folder));
    Calibrations::open_with(store, true, reader, timeout, Arc::default()).unwrap()
}

#[test]
fn a_file_that_takes_too_long_is_reported_as_broken() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["lobby", "slow", "yard"] {
        let file = folder.path().join(format!("{name}.json"));
        fs::write(file, content(name, 190.0)).unwrap();
    }
    let SlowFiles {
        reader,
        release,
        begun,
    } = slow_files(SHORT);
    let calibrations = open_slow(folder.path(), reader, LONG);
    for _ in 0..2 {
        let health = calibrations.health();
        assert_eq!(health.serving, 2);
        let [(file, problem)] = &health.problems[..] else {
            panic!("{health:?}");
        };
        assert_eq!(file, "slow.json");
        assert!(problem.contains("takes more than 0.4 s"), "{problem}");
        calibrations.refresh();
    }
    // Without a change it is not tried again.
    assert_eq!(begun.load(Ordering::Relaxed), 1);
    drop(release);
    fs::write(folder.path().join("slow.json"), content("slow", 200.0)).unwrap();
    calibrations.refresh();
    assert!(revision(&calibrations, "slow").is_some());
}

#[test]
fn many_slow_files_take_two_threads_and_are_read_later() {
    let folder = tempfile::tempdir().unwrap();
    for number in 0..5 {
        let name = format!("slow{number}");
        let file = folder.path().join(format!("{name}.json"));
        fs::write(file, content(&name, 190.0)).unwrap();
    }
    let SlowFiles {
        reader,
        release,
        begun,
    } = slow_files(SHORT);
    let calibrations = open_slow(folder.path(), reader, LONG);
    calibrations.refresh();
    assert_eq!(begun.load(Ordering::Relaxed), 2);
    let health = calibrations.health();
    let waiting = health.problems.iter();
    let waiting = waiting.filter(|(_, problem)| problem.contains("not read yet"));
    assert_eq!((health.problems.len(), waiting.count()), (5, 3));
    drop(release);
    while calibrations.health().serving < 3 {
        calibrations.refresh();
        thread::yield_now();
    }
}

#[test]
fn the_start_does_not_wait_for_slow_files() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("slow.json"), content("slow", 190.0)).unwrap();
    let SlowFiles {
        reader, release, ..
    } = slow_files(LONG);
    let calibrations = open_slow(folder.path(), reader, Duration::ZERO);
    assert!(!calibrations.is_read());
    assert_eq!(calibrations.health().serving, 0);
    drop(release);
    while !calibrations.is_read() {
        thread::yield_now();
    }
    assert!(revision(&calibrations, "slow").is_some());
}

#[test]
fn a_store_that_fails_after_the_start_is_reported() {
    /// Fails as soon as the test allows it.
    #[derive(Debug)]
    struct Late(Mutex<Receiver<()>>);
    impl CalibrationStore for Late {
        fn place(&self) -> String {
            "late".to_owned()
        }
        fn list(&self) -> Result<Vec<ListedFile>, StoreError> {
            let _ = self.0.lock().recv();
            let (place, problem) = (self.place(), "it is silent".to_owned());
            Err(StoreError::Failed { place, problem })
        }
        fn read(&self, _: &str, _: usize) -> Result<Vec<u8>, StoreError> {
            Ok(Vec::new())
        }
        fn write(&self, _: &str, _: &[u8], _: Replaces<'_>) -> Result<(), StoreError> {
            Ok(())
        }
        fn delete(&self, _: &str) -> Result<(), StoreError> {
            Ok(())
        }
    }
    let (release, released) = sync_channel(0);
    let store = Box::new(Late(Mutex::new(released)));
    let calibrations =
        Calibrations::open_within(store, true, Duration::ZERO, Arc::default()).unwrap();
    assert_eq!(calibrations.health().store_problem, None);
    drop(release);
    while !calibrations.is_read() {
        thread::yield_now();
    }
    let problem = calibrations.health().store_problem.unwrap();
    assert!(problem.contains("it is silent"), "{problem}");
}
