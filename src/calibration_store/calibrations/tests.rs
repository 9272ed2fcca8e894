use std::{
    fs,
    path::Path,
    sync::{
        atomic::{AtomicBool, Ordering},
        mpsc::Receiver,
    },
};

use super::*;
use crate::calibration_store::{FolderStore, ListedFile, Replaces};

fn content(id: &str, focal: f64) -> String {
    format!(
        r#"{{"id":"{id}","image":{{"width":600,"height":600}},
            "lens":{{"model":"equidistant","focal":{focal},"cx":299.5,"cy":299.5}}}}"#
    )
}

fn open(folder: &Path) -> Calibrations {
    Calibrations::open(Box::new(FolderStore::new(folder)), true, Arc::default()).unwrap()
}

fn failed_loads(calibrations: &Calibrations) -> u64 {
    let loads = &calibrations.metrics.calibration_loads;
    loads.with_label_values(&["failure"]).get()
}

fn id(id: &str) -> CalibrationId {
    id.parse().unwrap()
}

fn revision(calibrations: &Calibrations, of: &str) -> Option<String> {
    let entry = calibrations.entry(&id(of))?;
    Some(entry.calibration.revision().to_owned())
}

const TWO_CAMERAS: &str = "cam0:\n  camera_model: pinhole\n  distortion_model: equidistant\n  \
    distortion_coeffs: [0, 0, 0, 0]\n  intrinsics: [190, 190, 299, 299]\n  resolution: [600, 600]\n\
    cam1:\n  camera_model: ds\n  distortion_model: none\n  distortion_coeffs: []\n  \
    intrinsics: [-0.2, 0.6, 190, 190, 299, 299]\n  resolution: [600, 600]\n";

#[test]
fn a_new_changed_or_removed_file_is_seen_at_the_next_look() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("lobby.json");
    let calibrations = open(folder.path());
    assert_eq!(calibrations.get(&id("lobby")).unwrap(), None);

    fs::write(&file, content("lobby", 190.0)).unwrap();
    calibrations.refresh();
    let first = calibrations.get(&id("lobby")).unwrap().unwrap();
    calibrations.refresh();
    let same = calibrations.get(&id("lobby")).unwrap().unwrap();
    assert!(
        Arc::ptr_eq(&first, &same),
        "an unchanged file was read again"
    );

    fs::write(&file, content("lobby", 200.25)).unwrap();
    calibrations.refresh();
    let second = calibrations.get(&id("lobby")).unwrap().unwrap();
    assert_ne!(first.revision(), second.revision());

    fs::remove_file(&file).unwrap();
    calibrations.refresh();
    assert_eq!(calibrations.get(&id("lobby")).unwrap(), None);
}

#[test]
fn a_config_map_whose_link_turns_is_seen_at_the_next_look() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    for (version, focal) in [("..v1", 190.0), ("..v2", 200.0)] {
        fs::create_dir(path(version)).unwrap();
        fs::write(path(version).join("lobby.json"), content("lobby", focal)).unwrap();
    }
    let link = |from: &str, to: &str| std::os::unix::fs::symlink(to, path(from)).unwrap();
    link("..data", "..v1");
    link("lobby.json", "..data/lobby.json");
    let calibrations = open(folder.path());
    let first = revision(&calibrations, "lobby").unwrap();
    link("..data_tmp", "..v2");
    fs::rename(path("..data_tmp"), path("..data")).unwrap();
    fs::remove_dir_all(path("..v1")).unwrap();
    calibrations.refresh();
    assert_ne!(revision(&calibrations, "lobby").unwrap(), first);
    assert_eq!(calibrations.health().problems, []);
}

#[test]
fn invalid_new_version_leaves_the_old_one_serving() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("lobby.json");
    fs::write(&file, content("lobby", 190.0)).unwrap();
    let calibrations = open(folder.path());
    let good = revision(&calibrations, "lobby");
    let all_good = calibrations.health().revision;
    for broken in ["{", &content("lobby", -1.0), &content("yard", 190.0)] {
        fs::write(&file, broken).unwrap();
        calibrations.refresh();
        assert_eq!(revision(&calibrations, "lobby"), good, "{broken}");
        let health = calibrations.health();
        assert_eq!((health.serving, health.problems.len()), (1, 1), "{broken}");
        assert_eq!(health.revision, all_good, "{broken}");
        assert_eq!(health.problems[0].0, "lobby.json");
    }
    let failed = failed_loads(&calibrations);
    calibrations.refresh();
    assert_eq!((failed, failed_loads(&calibrations)), (3, 3));
    fs::write(&file, content("lobby", 201.125)).unwrap();
    calibrations.refresh();
    assert_ne!(revision(&calibrations, "lobby"), good);
    assert_ne!(calibrations.health().revision, all_good);
    assert_eq!(calibrations.health().problems, []);
}

#[test]
fn invalid_camera_leaves_the_others_and_its_last_version() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("lobby.yaml");
    fs::write(&file, TWO_CAMERAS).unwrap();
    let calibrations = open(folder.path());
    let first = ["lobby-cam0", "lobby-cam1"].map(|id| revision(&calibrations, id).unwrap());
    fs::write(&file, TWO_CAMERAS.replace("0.6, 190", "70.6, 190")).unwrap();
    calibrations.refresh();
    assert_ne!(revision(&calibrations, "lobby-cam0").unwrap(), first[0]);
    assert_eq!(revision(&calibrations, "lobby-cam1").unwrap(), first[1]);
    let health = calibrations.health();
    assert_eq!(health.problems.len(), 1);
    assert!(
        health.problems[0].1.starts_with("lobby-cam1: "),
        "{health:?}"
    );
}

#[test]
fn a_store_that_fails_leaves_everything_serving() {
    let folder = tempfile::tempdir().unwrap();
    let inside = folder.path().join("calibrations");
    fs::create_dir(&inside).unwrap();
    fs::write(inside.join("lobby.json"), content("lobby", 190.0)).unwrap();
    let calibrations = open(&inside);
    fs::rename(&inside, folder.path().join("elsewhere")).unwrap();
    calibrations.refresh();
    assert!(revision(&calibrations, "lobby").is_some());
    assert!(calibrations.health().store_problem.is_some());
    fs::rename(folder.path().join("elsewhere"), &inside).unwrap();
    calibrations.refresh();
    assert_eq!(calibrations.health().store_problem, None);
}

#[test]
fn an_unreadable_file_is_retried_and_reported_once() {
    /// Lists a file that it does not have.
    #[derive(Debug)]
    struct Liar;
    impl CalibrationStore for Liar {
        fn place(&self) -> String {
            "liar".to_owned()
        }
        fn list(&self) -> Result<Vec<ListedFile>, StoreError> {
            let (name, stamp) = ("lobby.json".to_owned(), "1".to_owned());
            Ok(vec![ListedFile { name, stamp }])
        }
        fn read(&self, _: &str, _: usize) -> Result<Vec<u8>, StoreError> {
            let (place, problem) = (self.place(), "it is gone".to_owned());
            Err(StoreError::Failed { place, problem })
        }
        fn write(&self, _: &str, _: &[u8], _: Replaces<'_>) -> Result<(), StoreError> {
            Ok(())
        }
        fn delete(&self, _: &str) -> Result<(), StoreError> {
            Ok(())
        }
    }
    let calibrations = Calibrations::open(Box::new(Liar), true, Arc::default()).unwrap();
    calibrations.refresh();
    assert_eq!(failed_loads(&calibrations), 1);
    let error = calibrations.get(&id("lobby")).unwrap_err().to_string();
    assert_eq!(error, "liar/lobby.json: liar: it is gone");
}

#[test]
fn a_change_that_cannot_be_looked_at_is_not_said_to_have_failed() {
    /// Takes what is written and then does not answer.
    #[derive(Debug, Default)]
    struct Mute(AtomicBool);
    impl CalibrationStore for Mute {
        fn place(&self) -> String {
            "mute".to_owned()
        }
        fn list(&self) -> Result<Vec<ListedFile>, StoreError> {
            if self.0.load(Ordering::Relaxed) {
                let (place, problem) = (self.place(), "it is silent".to_owned());
                return Err(StoreError::Failed { place, problem });
            }
            Ok(Vec::new())
        }
        fn read(&self, _: &str, _: usize) -> Result<Vec<u8>, StoreError> {
            Ok(Vec::new())
        }
        fn write(&self, _: &str, _: &[u8], _: Replaces<'_>) -> Result<(), StoreError> {
            self.0.store(true, Ordering::Relaxed);
            Ok(())
        }
        fn delete(&self, _: &str) -> Result<(), StoreError> {
            Ok(())
        }
    }
    let calibrations = Calibrations::open(Box::new(Mute::default()), true, Arc::default()).unwrap();
    let put = || {
        let content = content("lobby", 190.0);
        let always = WriteCondition::Always;
        calibrations.put(
            &id("lobby"),
            content.as_bytes(),
            &Reading::default(),
            &always,
        )
    };
    let changed = put().unwrap_err();
    assert!(matches!(changed, ChangeError::Unseen(_)), "{changed}");
    let not_changed = put().unwrap_err();
    assert!(
        matches!(not_changed, ChangeError::Store(_)),
        "{not_changed}"
    );
}

#[test]
fn a_file_whose_name_and_id_differ_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("lobby.json"), content("yard", 190.0)).unwrap();
    let error = open(folder.path())
        .get(&id("lobby"))
        .unwrap_err()
        .to_string();
    assert!(
        error.ends_with("id: it is \"yard\", but the file's name says \"lobby\": make them equal"),
        "{error}"
    );
}

#[test]
fn a_missing_folder_is_refused_by_name() {
    let store = FolderStore::new(Path::new("/nowhere/at/all"));
    let error = Calibrations::open(Box::new(store), true, Arc::default()).unwrap_err();
    assert!(
        error.to_string().starts_with("/nowhere/at/all: "),
        "{error}"
    );
}

#[test]
fn a_dropped_file_of_another_program_is_a_calibration() {
    let folder = tempfile::tempdir().unwrap();
    let colmap = "1 OPENCV_FISHEYE 600 600 190 190 300 300 0 0 0 0\n";
    fs::write(folder.path().join("yard.txt"), colmap).unwrap();
    let yard = open(folder.path()).get(&id("yard")).unwrap().unwrap();
    assert_eq!(yard.id().as_str(), "yard");
    assert_eq!(yard.image_size(), (600, 600));
}

#[test]
fn the_cameras_of_one_file_have_its_name_and_their_own() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("lobby-east.yaml"), TWO_CAMERAS).unwrap();
    let calibrations = open(folder.path());
    let get = |name: &str| calibrations.get(&id(name));
    let model = |name: &str| get(name).unwrap().map(|camera| camera.lens().model());
    assert_eq!(model("lobby-east-cam0"), Some("kannala_brandt"));
    assert_eq!(model("lobby-east-cam1"), Some("double_sphere"));
    for unknown in ["lobby-east-cam2", "lobby", "lobby-west-cam0"] {
        assert_eq!(model(unknown), None, "{unknown}");
    }
    let error = get("lobby-east").unwrap_err().to_string();
    assert!(
        error.contains("the file holds 2: name one of lobby-east-cam0, lobby-east-cam1"),
        "{error}"
    );
}

#[test]
fn invalid_file_leaves_calibrations_with_longer_names_alone() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("lobby.json"), "{").unwrap();
    let calibrations = open(folder.path());
    assert_eq!(calibrations.get(&id("lobby-2")).unwrap(), None);
    assert!(calibrations.get(&id("lobby")).is_err());
}

#[test]
fn a_stored_calibration_takes_the_place_of_a_sample() {
    let folder = tempfile::tempdir().unwrap();
    let calibrations = open(folder.path());
    let office = id("sample-office");
    let sample = calibrations.get(&office).unwrap().unwrap();
    assert!(calibrations.rows().is_empty());

    let revision = WriteCondition::IfRevision(vec![sample.revision().to_owned()]);
    let changed = content("sample-office", 200.25);
    let reading = Reading::default();
    let put = calibrations.put(&office, changed.as_bytes(), &reading, &revision);
    assert!(!put.unwrap().created);
    assert_ne!(*calibrations.get(&office).unwrap().unwrap(), *sample);

    calibrations
        .delete(&office, &WriteCondition::Always)
        .unwrap();
    assert_eq!(calibrations.get(&office).unwrap().unwrap(), sample);
    let refused = calibrations
        .delete(&office, &WriteCondition::Always)
        .unwrap_err();
    assert!(matches!(refused, ChangeError::Sample { .. }), "{refused}");
}

#[test]
fn an_unusable_file_is_not_hidden_by_a_sample() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("sample-office.json"), "{").unwrap();
    let refused = open(folder.path()).get(&id("sample-office")).unwrap_err();
    assert!(
        refused.place.ends_with("sample-office.json"),
        "{}",
        refused.place
    );
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
