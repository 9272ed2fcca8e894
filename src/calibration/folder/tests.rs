use super::*;

fn content(id: &str, focal: f64) -> String {
    format!(
        r#"{{"id":"{id}","image":{{"width":600,"height":600}},
            "lens":{{"model":"equidistant","focal":{focal},"cx":299.5,"cy":299.5}}}}"#
    )
}

#[test]
fn a_changed_file_is_seen_without_a_restart() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("lobby.json");
    std::fs::write(&file, content("lobby", 190.0)).unwrap();
    let calibrations = CalibrationFolder::open(folder.path()).unwrap();
    let id = "lobby".parse().unwrap();
    let first = calibrations.get(&id).unwrap().unwrap();
    assert!(Arc::ptr_eq(
        &first,
        &calibrations.get(&id).unwrap().unwrap()
    ));

    std::fs::write(&file, content("lobby", 200.25)).unwrap();
    let second = calibrations.get(&id).unwrap().unwrap();
    assert_ne!(first.revision(), second.revision());

    std::fs::remove_file(&file).unwrap();
    assert_eq!(calibrations.get(&id).unwrap(), None);
}

#[test]
fn a_file_whose_name_and_id_differ_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("lobby.json"), content("yard", 190.0)).unwrap();
    let calibrations = CalibrationFolder::open(folder.path()).unwrap();
    let error = calibrations
        .get(&"lobby".parse().unwrap())
        .unwrap_err()
        .to_string();
    assert!(
        error.ends_with("id: it is \"yard\", but the file's name says \"lobby\": make them equal"),
        "{error}"
    );
}

#[test]
fn a_missing_folder_is_refused_by_name() {
    let error = CalibrationFolder::open(Path::new("/nowhere/at/all")).unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("/nowhere/at/all: cannot be read"),
        "{error}"
    );
}

const TWO_CAMERAS: &str = "cam0:\n  camera_model: pinhole\n  distortion_model: equidistant\n  \
    distortion_coeffs: [0, 0, 0, 0]\n  intrinsics: [190, 190, 299, 299]\n  resolution: [600, 600]\n\
    cam1:\n  camera_model: ds\n  distortion_model: none\n  distortion_coeffs: []\n  \
    intrinsics: [-0.2, 0.6, 190, 190, 299, 299]\n  resolution: [600, 600]\n";

#[test]
fn a_dropped_file_of_another_program_is_a_calibration() {
    let folder = tempfile::tempdir().unwrap();
    let colmap = "1 OPENCV_FISHEYE 600 600 190 190 300 300 0 0 0 0\n";
    std::fs::write(folder.path().join("yard.txt"), colmap).unwrap();
    let calibrations = CalibrationFolder::open(folder.path()).unwrap();
    let yard = calibrations.get(&"yard".parse().unwrap()).unwrap().unwrap();
    assert_eq!(yard.id().as_str(), "yard");
    assert_eq!(yard.image_size(), (600, 600));
}

#[test]
fn the_cameras_of_one_file_have_its_name_and_their_own() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("lobby-east.yaml"), TWO_CAMERAS).unwrap();
    let calibrations = CalibrationFolder::open(folder.path()).unwrap();
    let get = |id: &str| calibrations.get(&id.parse().unwrap());
    let model = |id: &str| get(id).unwrap().map(|camera| camera.lens().model());
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
fn a_broken_file_says_nothing_about_calibrations_with_a_longer_name() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("lobby.json"), "{").unwrap();
    let calibrations = CalibrationFolder::open(folder.path()).unwrap();
    assert_eq!(calibrations.get(&"lobby-2".parse().unwrap()).unwrap(), None);
    assert!(calibrations.get(&"lobby".parse().unwrap()).is_err());
}
