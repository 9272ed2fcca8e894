//! Files of released versions: each later version reads them.

use std::{
    collections::HashMap,
    fs,
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

use lookdown::{cameras::Cameras, settings::load};
use lookdown_calibration::Calibration;
use lookdown_common::{OwnCameras, StoredFile};
use lookdown_count::Recording;
use lookdown_watch::Metrics;

/// The folders of the versions.
fn versions() -> Vec<PathBuf> {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/upgrade");
    let versions = fs::read_dir(root).unwrap();
    versions.map(|entry| entry.unwrap().path()).collect()
}

#[test]
fn counts_of_each_version_are_continued() {
    for version in versions() {
        let folder = tempfile::tempdir().unwrap();
        let store = folder.path().join("counts.sqlite");
        fs::copy(version.join("counts.sqlite"), &store).unwrap();
        let calibration = Calibration::read(&version.join("calibration.json")).unwrap();
        let gap = Duration::from_secs(10);
        let recording = Recording::open(&store, gap, "walks", Some(Arc::new(calibration))).unwrap();
        let until = recording.counted_until().unwrap();
        let start = "2026-11-22T09:00:00Z".parse().unwrap();
        assert!(until > start, "{}", version.display());
        let csv = recording.csv((start, until), 1).unwrap().unwrap();
        let mut rows = csv.lines().skip(1);
        let row = rows.next().unwrap();
        assert!(
            row.starts_with("2026-11-22T09:00:00Z,2026-11-22T09:01:00Z,5.8,0,5.724,3.131,8.317,6"),
            "{row}"
        );
    }
}

/// Writes the file of a kind with a version, and returns the error of reading it.
type Refusal = fn(&Path, &str) -> String;

#[test]
fn later_versions_are_refused_with_file_and_remedy() {
    let settings: Refusal = |folder, version| {
        let file = folder.join("lookdown.toml");
        fs::write(&file, format!("version = {version}\nkey_of_tomorrow = 1\n")).unwrap();
        load(Some(&file), HashMap::new()).unwrap_err().to_string()
    };
    let cameras: Refusal = |folder, version| {
        let file = folder.join("cameras.json");
        let content = format!(r#"{{"version": {version}, "cameras": {{"hall": 1}}}}"#);
        fs::write(file, content).unwrap();
        let metrics = Arc::new(Metrics::new().unwrap());
        let cameras = Cameras::new(folder.to_owned(), OwnCameras::default(), metrics);
        cameras.stored().unwrap_err().to_string()
    };
    let calibration: Refusal = |folder, version| {
        let file = folder.join("hall.json");
        let content = format!(
            r#"{{"id": "hall", "image": {{"width": 100, "height": 100}}, "lens_of_tomorrow": 1,
                "version": {version}}}"#
        );
        fs::write(&file, content).unwrap();
        Calibration::read(&file).unwrap_err().to_string()
    };
    for (kind, file, refusal) in [
        (StoredFile::Settings, "lookdown.toml", settings),
        (StoredFile::Cameras, "cameras.json", cameras),
        (StoredFile::Calibration, "hall.json", calibration),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let later = (kind.version() + 1).to_string();
        let refused = refusal(folder.path(), &later);
        assert!(refused.contains(file), "{refused}");
        let end = kind.check(&later).unwrap_err();
        assert!(refused.ends_with(&end), "{refused}");
    }
}

#[test]
fn the_present_version_may_be_written_down() {
    let folder = tempfile::tempdir().unwrap();
    for version in versions() {
        for file in ["lookdown.toml", "calibration.json", "cameras.json"] {
            let text = fs::read_to_string(version.join(file)).unwrap();
            let text = if file == "lookdown.toml" {
                format!("version = 1\n{text}")
            } else {
                text.replacen('{', "{\"version\": 1,", 1)
            };
            fs::write(folder.path().join(file), text).unwrap();
        }
        let metrics = Arc::new(Metrics::new().unwrap());
        let cameras = Cameras::new(folder.path().to_owned(), OwnCameras::default(), metrics);
        assert_eq!(cameras.stored().unwrap().len(), 2);
        assert!(load(Some(&folder.path().join("lookdown.toml")), HashMap::new()).is_ok());
        assert!(Calibration::read(&folder.path().join("calibration.json")).is_ok());
    }
}

#[test]
fn cameras_and_settings_of_each_version_are_read() {
    for version in versions() {
        let metrics = Arc::new(Metrics::new().unwrap());
        let cameras = Cameras::new(version.clone(), OwnCameras::default(), metrics)
            .stored()
            .unwrap();
        assert_eq!(cameras["hall"].user.as_deref(), Some("viewer"));
        assert!(cameras["lobby"].paused);
        let settings = load(Some(&version.join("lookdown.toml")), HashMap::new()).unwrap();
        assert_eq!(settings.lists.cameras.len(), 1);
        assert_eq!(settings.server.listen.port(), 8080);
    }
}
