//! COCO files, valid and invalid.

use super::super::test_support::{boxes, folder, open, refusal};
use super::*;
use crate::GroundTruth;

const CALIBRATION: &str = r#"{"id":"lobby","image":{"width":600,"height":600},
    "lens":{"model":"equidistant","focal":190,"cx":299.5,"cy":299.5}}"#;
const OWN: &str = r#"{"images":[{"id":7,"file_name":"a.jpg","calibration":"lobby"},
    {"id":8,"file_name":"b.jpg","calibration":"lobby"}],
  "annotations":[{"image_id":7,"bbox":[10,20,30,40],"visible_fraction":0.5},
    {"image_id":7,"bbox":[0,0,5,5],"iscrowd":1}]}"#;
const COCO: &str = r#"{"images":[{"id":1,"file_name":"a.jpg","width":640,"height":480}],
  "categories":[{"id":3,"name":"dog"},{"id":4,"name":"person"}],
  "annotations":[{"image_id":1,"category_id":3,"bbox":[1,2,3,4]},
    {"image_id":1,"category_id":4,"bbox":[10,20,30,40]}]}"#;

fn own_folder(annotations: &str) -> tempfile::TempDir {
    folder(&[
        ("annotations.json", annotations),
        ("calibrations/lobby.json", CALIBRATION),
    ])
}

#[test]
fn own_folder_has_persons_ignore_regions_and_calibrations() {
    let data_set = open(&own_folder(OWN));
    let [first, second] = &data_set.images[..] else {
        panic!("two images")
    };
    assert_eq!(boxes(first), [[10.0, 20.0, 40.0, 60.0]]);
    assert_eq!(first.truth.persons[0].visible_fraction, Some(0.5));
    assert_eq!(first.truth.ignore_regions.len(), 1);
    assert_eq!(first.id, ImageId::Number(7));
    assert_eq!(first.calibration.as_ref().unwrap().id().as_str(), "lobby");
    assert!(first.path.ends_with("images/a.jpg"));
    assert_eq!(second.truth, GroundTruth::default());
    assert_eq!(data_set.scoring, Scoring::AxisParallel);
}

#[test]
fn only_persons_of_a_coco_file_are_read() {
    let files = [
        ("annotations/instances_val.json", COCO),
        ("val/a.jpg", ""),
        ("val/b.jpg", ""),
    ];
    let folder = folder(&files);
    let file = folder.path().join(files[0].0);
    for data_set in [open(&folder), DataSet::open(&file).unwrap()] {
        let [image] = &data_set.images[..] else {
            panic!("one image")
        };
        assert_eq!(boxes(image), [[10.0, 20.0, 40.0, 60.0]]);
        assert!(image.path.ends_with("val/a.jpg"));
        assert_eq!(image.size, Some([640, 480]));
        assert_eq!(image.calibration, None);
    }
}

#[test]
fn boxes_of_five_numbers_are_rotated_clockwise_by_degrees() {
    let video = |name: &str| {
        format!(
            r#"{{"images":[{{"id":"{name}","file_name":"{name}.jpg","width":400,"height":300}}],
              "categories":[{{"id":1,"name":"person"}}],
              "annotations":[{{"image_id":"{name}","category_id":1,"iscrowd":0,
                "bbox":[100,90,20,60,-30]}}]}}"#
        )
    };
    let (lunch, meeting) = (video("Lunch1_000001"), video("Meeting1_000001"));
    let data_set = open(&folder(&[
        ("annotations/Lunch1.json", &lunch),
        ("annotations/Meeting1.json", &meeting),
        ("Lunch1/Lunch1_000001.jpg", ""),
        ("Meeting1/Meeting1_000001.jpg", ""),
    ]));
    assert_eq!(data_set.scoring, Scoring::Rotated);
    assert_eq!(data_set.images.len(), 2);
    let image = &data_set.images[1];
    assert_eq!(image.id, ImageId::Text("Meeting1_000001".to_owned()));
    let angle = (-30_f64).to_radians();
    let expected = RotatedBox::new([100.0, 90.0, 20.0, 60.0], angle, [400, 300]).unwrap();
    assert_eq!(
        image.truth.persons,
        [AnnotatedPerson::from(Outline::Rotated(expected))]
    );
}

#[test]
fn errors_name_the_file_and_the_problem() {
    for (from, to, expected) in [
        (
            "\"calibration\":\"lobby\"",
            "\"calibration\":\"yard\"",
            "there is no calibrations/yard.json",
        ),
        (
            "{\"image_id\":7",
            "{\"image_id\":9",
            "image_id 9 is not an image's id",
        ),
        ("\"id\":8", "\"id\":7", "the id 7 occurs twice"),
        (
            "[10,20,30,40]",
            "[10,20,-30,40]",
            "annotations[0].bbox: box",
        ),
        ("[10,20,30,40]", "[10,20,30]", "bbox: has 3 numbers"),
        (
            "[10,20,30,40]",
            "[10,20,30,40,0]",
            "its image has no width and height",
        ),
        ("0.5", "1.5", "visible_fraction: 1.5 is outside 0 to 1"),
        (
            "\"images\"",
            "\"files\"",
            "not a COCO annotation file: missing field `images`",
        ),
    ] {
        let error = refusal(&own_folder(&OWN.replace(from, to)));
        assert!(error.contains("annotations.json: "), "{error}");
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn mixed_boxes_and_categories_without_person_are_refused() {
    let with_angle = COCO
        .replace("[1,2,3,4]", "[50,50,3,4,5]")
        .replace("dog", "Person");
    for (annotations, expected) in [
        (
            COCO.replace("\"category_id\":3,", "\"category_id\":4,")
                .replace("[1,2,3,4]", "[50,50,3,4,5]"),
            "give all boxes 4 or all 5",
        ),
        (
            COCO.replace("\"person\"", "\"cat\""),
            "none of several is named person",
        ),
    ] {
        let error = refusal(&folder(&[
            ("annotations.json", &annotations),
            ("a.jpg", ""),
        ]));
        assert!(error.contains(expected), "{error}");
    }
    // The name of the category is compared without case.
    let data_set = open(&folder(&[("annotations.json", &with_angle), ("a.jpg", "")]));
    assert_eq!(data_set.scoring, Scoring::Rotated);
}
