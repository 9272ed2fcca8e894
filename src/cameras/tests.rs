use std::{fs, os::unix::fs::PermissionsExt, path::Path};

use super::*;

/// The cameras of a state folder within `folder`.
pub(crate) fn cameras(folder: &Path) -> Cameras {
    let metrics = Arc::new(Metrics::new().unwrap());
    Cameras::new(folder.join("state"), OwnCameras::default(), metrics)
}

/// Changes of the cameras wait until this is dropped, as for a folder that hangs.
pub(crate) fn hold(cameras: &Cameras) -> impl Drop + '_ {
    cameras.changing.lock()
}

/// A stored camera with this URL.
pub(crate) fn camera(url: &str) -> StoredCamera {
    StoredCamera {
        url: url.to_owned(),
        user: Some("viewer".to_owned()),
        every: None,
        calibration: None,
        profile: None,
        paused: false,
    }
}

#[test]
fn a_camera_is_stored_with_its_password_in_a_private_file() {
    let folder = tempfile::tempdir().unwrap();
    let password = Secret::from("geheim");
    let url = "rtsp://10.0.0.8/s2";
    assert!(
        cameras(folder.path())
            .put("hall", camera(url), Some(&password))
            .unwrap()
    );
    // After a restart.
    let cameras = cameras(folder.path());
    let mut entries = Vec::new();
    cameras.add_to(&mut entries).unwrap();
    let [entry] = entries.as_slice() else {
        panic!("one camera")
    };
    let file = entry.password_file.clone().unwrap();
    assert_eq!(fs::read_to_string(&file).unwrap(), "geheim\n");
    assert_eq!(
        fs::metadata(&file).unwrap().permissions().mode() & 0o777,
        0o600
    );
    let json = fs::read_to_string(folder.path().join("state").join(FILE)).unwrap();
    assert!(!json.contains("geheim"), "{json}");
    assert!(json.contains("\"version\": 1"), "{json}");
    assert!(cameras.delete("hall").unwrap());
    assert!(!file.exists() && !cameras.delete("hall").unwrap());
}

#[test]
fn a_password_stays_with_its_host_and_user_only() {
    let folder = tempfile::tempdir().unwrap();
    let cameras = cameras(folder.path());
    let password = Secret::from("geheim");
    cameras
        .put("hall", camera("rtsp://10.0.0.8/s2"), Some(&password))
        .unwrap();
    assert!(
        !cameras
            .put("hall", camera("rtsp://10.0.0.8/s1"), None)
            .unwrap()
    );
    assert!(cameras.folder.password("hall").exists());
    cameras
        .put("hall", camera("rtsp://10.0.0.9/s1"), None)
        .unwrap();
    assert!(
        !cameras.folder.password("hall").exists(),
        "another host never gets it"
    );
}

#[test]
fn only_urls_of_cameras_are_accepted() {
    let folder = tempfile::tempdir().unwrap();
    let cameras = cameras(folder.path());
    for url in [
        "file:///etc/passwd",
        "/etc/passwd",
        "-",
        "concat:a|b",
        "rtsp://u:p@c/",
        "rtsp://",
    ] {
        let error = cameras
            .put("hall", camera(url), None)
            .unwrap_err()
            .to_string();
        assert!(error.starts_with("url: it"), "{error}");
    }
    for name in ["../x", "test", "version"] {
        let error = cameras.put(name, camera("rtsp://c/"), None).unwrap_err();
        let start = format!("name: {name:?} is not");
        assert!(error.to_string().starts_with(&start), "{error}");
    }
}

#[test]
fn cameras_of_the_settings_file_have_precedence() {
    let folder = tempfile::tempdir().unwrap();
    let cameras = cameras(folder.path());
    let mut paused = camera("rtsp://10.0.0.8/s2");
    paused.paused = true;
    cameras.put("gate", paused, None).unwrap();
    cameras
        .put("hall", camera("rtsp://10.0.0.8/s2"), None)
        .unwrap();
    let own = entry("hall", &camera("rtsp://10.0.0.1/"));
    let mut entries = vec![own.clone()];
    cameras.add_to(&mut entries).unwrap();
    assert_eq!(entries, [own]);
    let refused = cameras.put("hall", camera("rtsp://10.0.0.8/s2"), None);
    assert!(refused.unwrap_err().to_string().contains("settings file"));
}

#[test]
fn detection_is_switched_off_until_it_is_switched_on() {
    let folder = tempfile::tempdir().unwrap();
    let add = |cameras: &Cameras| {
        let mut entries = vec![entry("gate", &camera("rtsp://10.0.0.1/"))];
        cameras.add_to(&mut entries).unwrap();
        let names = entries.into_iter().filter_map(|entry| entry.name);
        names.collect::<Vec<_>>()
    };
    let first = cameras(folder.path());
    first
        .put("hall", camera("rtsp://10.0.0.8/s2"), None)
        .unwrap();
    assert_eq!(add(&first), ["gate", "hall"]);
    for (name, is_known) in [("gate", true), ("hall", true), ("unknown", false)] {
        assert_eq!(first.set_detection(name, false).unwrap(), is_known);
    }
    // After a restart.
    let second = cameras(folder.path());
    assert_eq!(add(&second), [""; 0]);
    let both = |is_on| [("gate".to_owned(), is_on), ("hall".to_owned(), is_on)].into();
    assert_eq!(second.detection().unwrap(), both(false));
    let paused = second.paused_of_settings().unwrap();
    assert_eq!(
        paused,
        [("gate".to_owned(), "rtsp://10.0.0.1/".to_owned())].into()
    );
    for name in ["gate", "hall"] {
        second.set_detection(name, true).unwrap();
    }
    assert_eq!(add(&second), ["gate", "hall"]);
    assert_eq!(second.detection().unwrap(), both(true));
}

#[test]
fn a_camera_without_a_url_keeps_the_stored_one() {
    let folder = tempfile::tempdir().unwrap();
    let cameras = cameras(folder.path());
    let url = "rtsp://10.0.0.8/s2?token=1";
    let password = Secret::from("geheim");
    cameras.put("hall", camera(url), Some(&password)).unwrap();
    assert!(!cameras.put("hall", camera(""), None).unwrap());
    assert_eq!(cameras.stored().unwrap()["hall"].url, url);
    assert!(cameras.folder.password("hall").exists());
    let watched = cameras.get("hall").unwrap().unwrap();
    assert!(watched.credentials.is_some());
    let refused = cameras.put("gate", camera(""), None).unwrap_err();
    assert!(refused.to_string().starts_with("url: it is"), "{refused}");
    assert!(cameras.get("gate").unwrap().is_none());
}
