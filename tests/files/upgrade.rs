//! Files of released versions: each later version reads them.

use std::{collections::HashMap, fs, path::PathBuf, sync::Arc, time::Duration};

use lookdown::{cameras::Cameras, settings::load};
use lookdown_count::Recording;
use lookdown_lens::calibration::Calibration;
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
            row.starts_with("2026-11-22T09:00:00Z,2026-11-22T09:01:00Z,5.8,5.724,6"),
            "{row}"
        );
    }
}

#[test]
fn cameras_and_settings_of_each_version_are_read() {
    for version in versions() {
        let metrics = Arc::new(Metrics::new().unwrap());
        let cameras = Cameras::new(version.clone(), metrics).stored().unwrap();
        assert_eq!(cameras["hall"].user.as_deref(), Some("viewer"));
        assert!(cameras["lobby"].paused);
        let settings = load(Some(&version.join("lookdown.toml")), HashMap::new()).unwrap();
        assert_eq!(settings.lists.cameras.len(), 1);
        assert_eq!(settings.server.listen.port(), 8080);
    }
}
