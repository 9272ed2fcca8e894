//! Reads the content of calibration files within a time limit: a file that takes long delays
//! neither the others nor the start for more than that.

use std::{
    fmt,
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
        mpsc::{RecvTimeoutError, sync_channel},
    },
    thread,
    time::Duration,
};

use lookdown_calibration::{CalibrationId, FormatError};

use super::content::{Cameras, cameras};

/// Longest time for a file.
const TIME_LIMIT: Duration = Duration::from_secs(5);
/// Most files beyond their time that may still be read: a thread cannot be stopped from outside.
const MAX_OVERDUE: usize = 2;

type Parse = dyn Fn(&CalibrationId, &str, &[u8]) -> Result<Cameras, FormatError> + Send + Sync;

/// Reads files, each in a thread of its own.
pub(super) struct FileReader {
    parse: Arc<Parse>,
    time_limit: Duration,
    reading: Arc<AtomicUsize>,
}

/// The reason why a file is not used.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Unread {
    /// One sentence.
    pub(super) problem: String,
    /// True if the same file may be read later.
    pub(super) is_passing: bool,
}

impl Default for FileReader {
    fn default() -> Self {
        Self::new(TIME_LIMIT, cameras)
    }
}

impl fmt::Debug for FileReader {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("FileReader").finish_non_exhaustive()
    }
}

impl FileReader {
    pub(super) fn new(
        time_limit: Duration,
        parse: impl Fn(&CalibrationId, &str, &[u8]) -> Result<Cameras, FormatError>
        + Send
        + Sync
        + 'static,
    ) -> Self {
        Self {
            parse: Arc::new(parse),
            time_limit,
            reading: Arc::default(),
        }
    }

    /// Returns the cameras that the file called `name`, of the ID `stem`, holds.
    ///
    /// # Errors
    /// [`Unread`] for content that cannot be used, or takes longer than the time limit.
    pub(super) fn read(
        &self,
        stem: &CalibrationId,
        name: &str,
        content: Vec<u8>,
    ) -> Result<Cameras, Unread> {
        let passing = |problem: &str| Unread {
            problem: problem.to_owned(),
            is_passing: true,
        };
        let lasting = |problem: String| Unread {
            problem,
            is_passing: false,
        };
        if self.reading.load(Ordering::Relaxed) >= MAX_OVERDUE {
            return Err(passing(
                "it is not read yet, because other files take too long: remove those",
            ));
        }
        let (done, outcome) = sync_channel(1);
        let (parse, own) = (Arc::clone(&self.parse), Counted::new(&self.reading));
        let (stem, name) = (stem.clone(), name.to_owned());
        let thread = thread::Builder::new().name("calibration-file".to_owned());
        let begun = thread.spawn(move || {
            let outcome = parse(&stem, &name, &content);
            drop(own);
            // The caller may have stopped waiting.
            let _ = done.send(outcome);
        });
        begun
            .map_err(|error| passing(&format!("the operating system gives no thread: {error}")))?;
        match outcome.recv_timeout(self.time_limit) {
            Ok(outcome) => outcome.map_err(|error| lasting(error.to_string())),
            Err(RecvTimeoutError::Timeout) => {
                let seconds = self.time_limit.as_secs_f64();
                Err(lasting(format!(
                    "reading it takes more than {seconds} s: give a smaller or simpler file"
                )))
            }
            Err(RecvTimeoutError::Disconnected) => Err(lasting(
                "reading it failed because of a fault of ours".to_owned(),
            )),
        }
    }
}

/// Counts a file for as long as it is read.
struct Counted(Arc<AtomicUsize>);

impl Counted {
    fn new(count: &Arc<AtomicUsize>) -> Self {
        count.fetch_add(1, Ordering::Relaxed);
        Self(Arc::clone(count))
    }
}

impl Drop for Counted {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}
