use lookdown_detect::{detection::Refinement, parameters::Profile};
use serde_json::json;

use super::*;

/// Two images, 7 and 8.
fn data_set() -> (tempfile::TempDir, DataSet) {
    let folder = tempfile::tempdir().unwrap();
    let annotations = json!({
        "images": [
            {"id": 7, "file_name": "a.jpg", "calibration": "lobby"},
            {"id": 8, "file_name": "b.jpg", "calibration": "lobby"},
        ],
        "annotations": [],
    });
    let calibration = json!({
        "id": "lobby", "image": {"width": 600, "height": 600},
        "lens": {"model": "equidistant", "focal": 190, "cx": 299.5, "cy": 299.5},
    });
    fs::create_dir(folder.path().join("calibrations")).unwrap();
    let write = |name: &str, text: serde_json::Value| {
        fs::write(folder.path().join(name), text.to_string()).unwrap();
    };
    write("annotations.json", annotations);
    write("calibrations/lobby.json", calibration);
    let data_set = DataSet::open(folder.path()).unwrap();
    (folder, data_set)
}

fn row(images: Vec<Vec<FoundPerson>>) -> DetectedRow {
    DetectedRow {
        name: RowName {
            profile: Some(Profile::Paper),
            refinement: Some(Refinement::SoftNmsLinear),
            model: "tiny-0.5".to_owned(),
        },
        refinement: None,
        cost: None,
        images,
    }
}

fn person(oriented_box: Option<OrientedBox>) -> FoundPerson {
    FoundPerson {
        bbox: BBox::new([10.25, 20.5, 40.0, 60.125]).unwrap(),
        oriented_box,
        score: 0.1 + 0.2,
    }
}

#[test]
fn a_row_survives_saving_and_loading() {
    let (folder, data_set) = data_set();
    let oriented = OrientedBox::turned(Pixel::new(25.0, 40.0), 20.0, 35.5, 0.5);
    let saved = row(vec![vec![], vec![person(Some(oriented)), person(None)]]);
    let rows = folder.path().join("rows");
    saved.save(&rows, &data_set).unwrap();
    let path = rows.join("paper.soft_nms_linear.tiny-0.5.json");
    let loaded = DetectedRow::load(&path, &data_set).unwrap();
    assert_eq!(loaded.name, saved.name);
    assert_eq!(loaded.images[0], []);
    assert_eq!(loaded.images[1][1], saved.images[1][1]);
    let turned = loaded.images[1][0].oriented_box.unwrap();
    assert!((turned.up - oriented.up).norm() < 1e-12);
    assert_eq!(turned.center, oriented.center);
}

#[test]
fn rows_are_saved_as_coco_results() {
    let (folder, data_set) = data_set();
    row(vec![vec![person(None)], vec![]])
        .save(folder.path(), &data_set)
        .unwrap();
    let text = fs::read_to_string(folder.path().join("paper.soft_nms_linear.tiny-0.5.json"));
    let results: serde_json::Value = serde_json::from_str(&text.unwrap()).unwrap();
    let expected = json!([{"image_id": 7, "category_id": 1, "bbox": [10.25, 20.5, 29.75, 39.625],
                           "score": 0.1 + 0.2}]);
    assert_eq!(results, expected);
}

#[test]
fn results_of_other_detectors_are_read_without_extra_keys() {
    let (folder, data_set) = data_set();
    let path = folder.path().join("faster.rcnn.json");
    let results = json!([
        {"image_id": 8, "category_id": 1, "bbox": [1, 2, 3, 4], "score": 0.5, "id": 1},
        {"image_id": 8, "category_id": 62, "bbox": [1, 2, 3, 4], "score": 0.9},
    ]);
    fs::write(&path, results.to_string()).unwrap();
    let row = DetectedRow::load(&path, &data_set).unwrap();
    assert_eq!(
        (row.name.profile, row.name.model.as_str()),
        (None, "faster.rcnn")
    );
    assert_eq!(row.images[1].len(), 1);
    assert_eq!(row.images[1][0].bbox.corners(), [1.0, 2.0, 4.0, 6.0]);
}

#[test]
fn errors_name_the_file_and_the_problem() {
    let (folder, data_set) = data_set();
    let path = folder.path().join("results.json");
    for (text, expected) in [
        (
            r#"[{"image_id":9,"category_id":1,"bbox":[1,2,3,4],"score":0.5}]"#,
            "results.json: [0].image_id: 9 is not an image of the data set",
        ),
        (
            r#"[{"image_id":7,"category_id":1,"bbox":[1,2,-3,4],"score":0.5}]"#,
            "results.json: [0].bbox: box [1.0, 2.0, -2.0, 6.0] is inverted",
        ),
        (r#"{"images":[]}"#, "results.json: not COCO results"),
    ] {
        fs::write(&path, text).unwrap();
        let error = DetectedRow::load(&path, &data_set).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
    let missing = DetectedRow::load(&folder.path().join("none.json"), &data_set);
    assert!(missing.unwrap_err().to_string().contains("cannot be read"));
}

#[test]
fn images_that_share_an_id_are_refused() {
    let (folder, mut data_set) = data_set();
    data_set.images[1].id = data_set.images[0].id.clone();
    let error = row(vec![vec![], vec![]]).save(folder.path(), &data_set);
    let error = error.unwrap_err().to_string();
    assert!(error.contains("several images with the ID 7"), "{error}");
}
