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
