//! The manifests of the families in the documentation, with networks in the layout of their
//! exports.

use std::fs;

use lookdown_detect::inference::{Detector, OnnxDetector};
use lookdown_imaging::ViewBatch;

use crate::models::folder::{in_repository, library, options};

#[test]
fn manifests_of_the_families_are_documented_and_run() {
    let documentation = fs::read_to_string(in_repository("docs/models.md")).unwrap();
    let folders = fs::read_dir(in_repository("tests/fixtures/models/families")).unwrap();
    let folders: Vec<_> = folders.map(|entry| entry.unwrap().path()).collect();
    assert_eq!(folders.len(), 6);
    for folder in folders {
        let manifest = fs::read_to_string(folder.join("model.toml")).unwrap();
        assert!(documentation.contains(&manifest), "{}", folder.display());
        let mut detector = OnnxDetector::load(&library(), &folder, &options()).unwrap();
        let mut batch = ViewBatch::default();
        for slot in batch.prepare(2, detector.input()) {
            slot.fill(0.5);
        }
        let found = detector.detect(&batch).unwrap();
        assert_eq!((found.per_view.len(), found.non_finite), (2, 0));
    }
}
