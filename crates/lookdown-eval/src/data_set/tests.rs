//! Tests of the recognition of data sets, and of operations on all kinds.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use lookdown_calibration::Calibration;
use lookdown_detect::detection::BBox;

use super::{
    test_support::{boxes, folder, open, refusal},
    *,
};
use crate::{Outline, Scoring};

const CALIBRATION: &str = r#"{"id":"lobby","image":{"width":600,"height":600},
    "lens":{"model":"equidistant","focal":190,"cx":299.5,"cy":299.5}}"#;
const ROTATED: &str = r#"{"images":[{"id":"a_1","file_name":"a_1.jpg","width":600,"height":600}],
    "annotations":[{"image_id":"a_1","bbox":[300,200,20,60,90]},
        {"image_id":"a_1","bbox":[100,200,20,60,0],"iscrowd":1}]}"#;

#[test]
fn a_folder_of_other_files_is_refused() {
    let folder = folder(&[("readme.txt", ""), ("a.jpg", "")]);
    let message = refusal(&folder);
    assert!(
        message.contains("holds no data set in a known format"),
        "{message}"
    );
    let file = DataSet::open(&folder.path().join("readme.txt"));
    assert!(
        file.unwrap_err()
            .to_string()
            .contains("no data set in a known format")
    );
    let nowhere = DataSet::open(Path::new("/nowhere"))
        .unwrap_err()
        .to_string();
    assert!(nowhere.starts_with("/nowhere: cannot be read"), "{nowhere}");
}

#[test]
fn one_calibration_can_be_set_for_every_image() {
    let files = [
        ("annotations.json", ROTATED),
        ("a_1.jpg", ""),
        ("lobby.json", CALIBRATION),
    ];
    let folder = folder(&files);
    let data_set = open(&folder);
    assert_eq!(data_set.images[0].calibration, None);
    let calibration = Calibration::read(&folder.path().join("lobby.json")).unwrap();
    let data_set = data_set.with_calibration(&Arc::new(calibration));
    let given = data_set.images[0].calibration.as_ref().unwrap();
    assert_eq!(given.id().as_str(), "lobby");
}

#[test]
fn rotated_truth_can_be_scored_as_bounds_of_ellipses() {
    let folder = folder(&[("annotations.json", ROTATED), ("a_1.jpg", "")]);
    let data_set = open(&folder).scored_as(Scoring::Rotated).unwrap();
    let data_set = data_set.scored_as(Scoring::AxisParallel).unwrap();
    assert_eq!(data_set.scoring, Scoring::AxisParallel);
    let [corners] = boxes(&data_set.images[0])[..] else {
        panic!("one person")
    };
    for (actual, expected) in corners.into_iter().zip([270.0, 190.0, 330.0, 210.0]) {
        assert!((actual - expected).abs() < 1e-9, "{corners:?}");
    }
    let region = BBox::new([90.0, 170.0, 110.0, 230.0]).unwrap();
    assert_eq!(
        data_set.images[0].truth.ignore_regions,
        [Outline::AxisParallel(region)]
    );
    let error = data_set.scored_as(Scoring::Rotated).unwrap_err();
    assert_eq!(
        error.to_string(),
        "this data set has axis-parallel boxes and cannot be scored by rotated boxes; only \
         rotated boxes can be made axis-parallel"
    );
}

#[test]
fn the_distance_from_the_center_is_an_angle_through_the_lens() {
    let folder = folder(&[("lobby.json", CALIBRATION)]);
    let mut image = DataSetImage::empty(ImageId::Number(1), PathBuf::new());
    assert_eq!(image.off_axis_deg([300.0, 300.0]), None);
    // Without a calibration: 90° at the edge of the shorter side, which is also the maximum.
    image.size = Some([800, 600]);
    assert_eq!(image.off_axis_deg([400.0, 300.0]), Some(0.0));
    assert_eq!(image.off_axis_deg([400.0, 150.0]), Some(45.0));
    assert_eq!(image.off_axis_deg([0.0, 300.0]), Some(90.0));
    // Twice the size of the calibration: 380 pixels per radian.
    image.size = Some([1200, 1200]);
    let calibration = Calibration::read(&folder.path().join("lobby.json")).unwrap();
    image.calibration = Some(Arc::new(calibration));
    let angle = image.off_axis_deg([600.0, 600.0 - 380.0]).unwrap();
    assert!((angle - 1_f64.to_degrees()).abs() < 1e-9, "{angle}");
}
