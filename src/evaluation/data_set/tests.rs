use super::*;

fn folder(annotations: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("annotations.json"), annotations).unwrap();
    std::fs::create_dir(folder.path().join("calibrations")).unwrap();
    std::fs::write(
        folder.path().join("calibrations/lobby.json"),
        r#"{"id":"lobby","image":{"width":600,"height":600},
            "lens":{"model":"equidistant","focal":190,"cx":299.5,"cy":299.5}}"#,
    )
    .unwrap();
    folder
}

const GOOD: &str = r#"{"images":[{"id":7,"file_name":"a.jpg","calibration":"lobby"},
    {"id":8,"file_name":"b.jpg","calibration":"lobby"}],
  "annotations":[{"image_id":7,"bbox":[10,20,30,40]},{"image_id":7,"bbox":[0,0,5,5],"iscrowd":1}]}"#;

#[test]
fn persons_and_ignore_regions_are_told_apart() {
    let folder = folder(GOOD);
    let data_set = DataSet::open(folder.path()).unwrap();
    assert_eq!(
        data_set.images[0].truth.persons[0].corners(),
        [10.0, 20.0, 40.0, 60.0]
    );
    assert_eq!(data_set.images[0].truth.ignore_regions.len(), 1);
    assert_eq!(data_set.images[1].truth, nobody());
    assert!(data_set.images[0].path.ends_with("images/a.jpg"));
}

#[test]
fn what_is_wrong_is_named() {
    for (from, to, expected) in [
        (
            "\"calibration\":\"lobby\"",
            "\"calibration\":\"yard\"",
            "there is no calibrations/yard.json",
        ),
        (
            "\"image_id\":7",
            "\"image_id\":9",
            "image_id 9 is no image's id",
        ),
        (
            "[10,20,30,40]",
            "[10,20,-30,40]",
            "annotations[0].bbox: box",
        ),
        (
            "\"images\"",
            "\"pictures\"",
            "not a COCO annotation file: missing field `images`",
        ),
    ] {
        let folder = folder(&GOOD.replace(from, to));
        let error = DataSet::open(folder.path()).unwrap_err().to_string();
        assert!(error.contains("annotations.json: "), "{error}");
        assert!(error.contains(expected), "{error}");
    }
    let error = DataSet::open(Path::new("/nowhere"))
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with("/nowhere/annotations.json: cannot be read"),
        "{error}"
    );
}
