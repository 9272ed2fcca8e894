use std::{fs, os::unix::fs::PermissionsExt, path::Path};

use lookdown_common::{Reload, ServerEntry};
use lookdown_watch::{Origin, WatchOptions, watch};
use serde_json::Value;
use tokio::time::timeout;

use super::*;

/// The cameras of a state folder within `folder`.
pub(crate) fn cameras(folder: &Path) -> Cameras {
    let metrics = Arc::new(Metrics::new().unwrap());
    Cameras::new(folder.join("state"), OwnCameras::default(), metrics)
}

/// Changes of the cameras wait until this is dropped, as for a folder that hangs.
pub(crate) fn hold(cameras: &Cameras) -> impl Sized {
    cameras.folder.lock().unwrap()
}

/// A camera of the settings.
fn configured(name: &str) -> Camera {
    entry(name, &camera("rtsp://10.0.0.1/")).check("").unwrap()
}

/// The cameras that are watched beside these of the settings.
fn watched(cameras: &Cameras, configured: &[Camera]) -> Vec<Camera> {
    let mut watched = configured.to_vec();
    cameras
        .add_to(&mut watched, &CameraEntry::default())
        .unwrap();
    watched
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
        keep_image: false,
    }
}

#[test]
fn a_deleted_camera_leaves_no_password_of_an_unfinished_change() {
    let folder = tempfile::tempdir().unwrap();
    let cameras = cameras(folder.path());
    let url = "rtsp://10.0.0.8/s2";
    cameras.put("hall", camera(url), None).unwrap();
    let left = ["hall", "hallnew~", "hallold~"].map(|name| cameras.folder.password(name));
    for file in &left {
        fs::create_dir_all(file.parent().unwrap()).unwrap();
        fs::write(file, "geheim").unwrap();
    }
    assert!(cameras.delete("hall").unwrap());
    assert!(left.iter().all(|file| !file.exists()), "{left:?}");
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
    let [watched] = &watched(&cameras, &[])[..] else {
        panic!("one camera")
    };
    let password = &watched.credentials.as_ref().unwrap().password;
    assert_eq!(*password, Secret::from("geheim"));
    let file = cameras.folder.password("hall");
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
    let own = configured("hall");
    assert_eq!(watched(&cameras, std::slice::from_ref(&own)), [own]);
    let refused = cameras.put("hall", camera("rtsp://10.0.0.8/s2"), None);
    assert!(refused.unwrap_err().to_string().contains("settings file"));
}

#[test]
fn detection_is_switched_off_until_it_is_switched_on() {
    let folder = tempfile::tempdir().unwrap();
    let add = |cameras: &Cameras| {
        let watched = watched(cameras, &[configured("gate")]);
        let names = watched.into_iter().map(|camera| camera.name);
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
    assert!(["gate", "hall"].map(|name| second.own.is_paused(name)) == [true; 2]);
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
    assert!(["gate", "hall"].map(|name| second.own.is_paused(name)) == [false; 2]);
}

#[test]
fn the_latest_image_is_kept_while_it_is_switched_on() {
    let folder = tempfile::tempdir().unwrap();
    let first = cameras(folder.path());
    first
        .put("hall", camera("rtsp://10.0.0.8/s2"), None)
        .unwrap();
    watched(&first, &[configured("gate")]);
    assert!(!first.keeps_image("gate") && !first.keeps_image("hall"));
    for name in ["gate", "hall"] {
        assert!(first.change(name, None, Some(true)).unwrap());
    }
    // After a restart.
    let second = cameras(folder.path());
    assert_eq!(watched(&second, &[configured("gate")]).len(), 2);
    assert!(second.keeps_image("gate") && second.keeps_image("hall"));
    assert!(second.change("hall", Some(true), Some(false)).unwrap());
    assert!(second.change("gate", None, Some(false)).unwrap());
    assert!(!second.keeps_image("gate") && !second.keeps_image("hall"));
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

#[test]
fn every_accepted_password_is_loaded_as_it_was_given() {
    let folder = tempfile::tempdir().unwrap();
    let cameras = cameras(folder.path());
    for password in ["", " ", "\r", "\n", "\nb", "a\nb", "a ", " a", "ä\u{0}"] {
        let given = Secret::from(password);
        cameras
            .put("hall", camera("rtsp://10.0.0.8/s2"), Some(&given))
            .unwrap();
        let loaded = watched(&cameras, &[]).remove(0).credentials.unwrap();
        assert_eq!(loaded.password, given, "{password:?}");
    }
}

#[test]
fn changes_of_two_processes_are_all_stored() {
    let folder = tempfile::tempdir().unwrap();
    let password = Secret::from("geheim");
    std::thread::scope(|scope| {
        for process in ["a", "b"] {
            let (cameras, password) = (cameras(folder.path()), &password);
            scope.spawn(move || {
                for number in 0..40 {
                    let name = format!("{process}{number}");
                    let camera = camera("rtsp://10.0.0.8/s2");
                    assert!(cameras.put(&name, camera, Some(password)).unwrap());
                }
            });
        }
    });
    assert_eq!(cameras(folder.path()).stored().unwrap().len(), 80);
}

#[test]
fn a_camera_is_not_read_in_the_middle_of_a_change() {
    let folder = tempfile::tempdir().unwrap();
    let cameras = cameras(folder.path());
    cameras
        .put("hall", camera("rtsp://10.0.0.8/"), None)
        .unwrap();
    let changing = hold(&cameras);
    std::thread::scope(|scope| {
        let (sender, answers) = std::sync::mpsc::sync_channel(1);
        let reader = &cameras;
        scope.spawn(move || sender.send(reader.get("hall").is_ok()));
        let early = answers.recv_timeout(Duration::from_millis(300));
        assert!(early.is_err(), "the change had not ended");
        drop(changing);
        assert_eq!(answers.recv(), Ok(true));
    });
}

#[test]
fn a_file_that_could_not_be_read_again_is_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let cameras = cameras(folder.path());
    let url = format!("rtsp://10.0.0.8/{}", "x".repeat(15_000));
    let put = |number: u32| cameras.put(&number.to_string(), camera(&url), None);
    let refused = (0..80).find_map(|number| put(number).err()).unwrap();
    assert!(refused.to_string().contains("too large"), "{refused}");
    assert!(cameras.stored().unwrap().len() > 60);
}

#[test]
fn a_damaged_file_is_named_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let cameras = cameras(folder.path());
    let file = cameras.folder.file(FILE);
    fs::create_dir_all(file.parent().unwrap()).unwrap();
    fs::write(file, "{\n\"hall\": {").unwrap();
    let problem = cameras.stored().unwrap_err().to_string();
    let expected = "is damaged at line 2: restore it, or delete it";
    assert!(problem.ends_with(expected), "{problem}");
}

#[test]
fn a_camera_that_cannot_be_watched_leaves_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let cameras = cameras(folder.path());
    let password = Secret::from("geheim");
    for name in ["broken", "good"] {
        cameras
            .put(name, camera("rtsp://10.0.0.8/s2"), Some(&password))
            .unwrap();
    }
    let file = cameras.folder.file(FILE);
    let mut json: Value = serde_json::from_slice(&fs::read(&file).unwrap()).unwrap();
    json["malformed"] = Value::from(1);
    json["Bad Name"] = json["good"].clone();
    json["late"] = serde_json::json!({ "url": "rtsp://10.0.0.8/", "every": "never" });
    fs::write(&file, json.to_string()).unwrap();
    fs::remove_file(cameras.folder.password("broken")).unwrap();
    fs::create_dir(cameras.folder.password("broken")).unwrap();
    let names = |cameras: &Cameras| {
        let watched = watched(cameras, &[]).into_iter();
        watched.map(|camera| camera.name).collect::<Vec<_>>()
    };
    assert_eq!(names(&cameras), ["good"]);
    let problems = cameras.problems();
    let with_problems: Vec<_> = problems.keys().map(String::as_str).collect();
    assert_eq!(with_problems, ["Bad Name", "broken", "late", "malformed"]);
    // A pause still applies, and the malformed entry is kept until it is deleted.
    assert!(cameras.set_detection("good", false).unwrap());
    assert_eq!(names(&cameras), [""; 0]);
    assert!(cameras.problems().contains_key("malformed"));
    assert!(cameras.delete("malformed").unwrap());
    names(&cameras);
    assert!(!cameras.problems().contains_key("malformed"));
}

#[test]
fn a_camera_is_checked_with_the_defaults_of_its_load() {
    let folder = tempfile::tempdir().unwrap();
    let cameras = cameras(folder.path());
    let defaults = CameraEntry {
        stall_after: Some("5s".to_owned()),
        ..CameraEntry::default()
    };
    cameras.add_to(&mut Vec::new(), &defaults).unwrap();
    let mut slow = camera("rtsp://10.0.0.8/s2");
    slow.every = Some("10s".to_owned());
    let refused = cameras.put("hall", slow, None).unwrap_err().to_string();
    assert!(refused.starts_with("stall_after: "), "{refused}");
}

#[tokio::test(start_paused = true)]
async fn a_camera_is_paused_once_it_is_not_watched() {
    let until = async |is_reached: &dyn Fn() -> bool| {
        while !is_reached() {
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
    };
    let folder = tempfile::tempdir().unwrap();
    let cameras = Arc::new(cameras(folder.path()));
    cameras
        .put("hall", camera("http://127.0.0.1:9/"), None)
        .unwrap();
    let (read, metrics) = (Arc::clone(&cameras), Arc::clone(&cameras.metrics));
    let settings = Reload::new(move || {
        let server = ServerEntry::default().check()?;
        let mut options = WatchOptions::new(server, Vec::new())?;
        read.add_to(&mut options.cameras, &CameraEntry::default())?;
        Ok::<_, ConfigError>(options)
    });
    let watching = watch(Origin::Reload(settings), metrics, std::future::pending());
    let watching = tokio::spawn(watching);
    until(&|| cameras.is_watched("hall")).await;
    cameras.set_detection("hall", false).unwrap();
    assert!(cameras.detection().unwrap()["hall"]);
    until(&|| !cameras.is_watched("hall")).await;
    assert!(!cameras.detection().unwrap()["hall"]);
    watching.abort();
}

#[tokio::test]
async fn a_few_cameras_are_tested_at_a_time() {
    let folder = tempfile::tempdir().unwrap();
    let cameras = Arc::new(cameras(folder.path()));
    // A camera that accepts connections and sends nothing.
    let silent = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}/", silent.local_addr().unwrap());
    let mut tests = tokio::task::JoinSet::new();
    for _ in 0..MAX_TESTS {
        let (cameras, camera) = (Arc::clone(&cameras), camera(&url));
        tests.spawn(async move { cameras.test(&camera, None).await });
    }
    let all_taken = async {
        while cameras.tests.available_permits() > 0 {
            tokio::task::yield_now().await;
        }
    };
    timeout(TEST_TIMEOUT, all_taken).await.unwrap();
    let refused = cameras.test(&camera(&url), None).await;
    assert!(matches!(refused, Err(CameraError::Busy)));
    tests.shutdown().await;
    assert_eq!(cameras.tests.available_permits(), MAX_TESTS);
}

#[test]
fn a_change_that_is_not_stored_keeps_the_password() {
    let folder = tempfile::tempdir().unwrap();
    let cameras = cameras(folder.path());
    let (before, after) = (Secret::from("geheim"), Secret::from("other"));
    cameras
        .put("hall", camera("rtsp://10.0.0.8/"), Some(&before))
        .unwrap();
    // The file of the cameras cannot be written.
    let blocked = folder
        .path()
        .join("state")
        .join(FILE)
        .with_extension("part");
    fs::create_dir(&blocked).unwrap();
    for password in [Some(&after), None] {
        cameras
            .put("hall", camera("rtsp://10.0.0.9/"), password)
            .unwrap_err();
        let camera = cameras.get("hall").unwrap().unwrap();
        assert_eq!(camera.location.to_string(), "rtsp://10.0.0.8/");
        assert_eq!(camera.credentials.unwrap().password, before);
    }
    fs::remove_dir(&blocked).unwrap();
    cameras
        .put("hall", camera("rtsp://10.0.0.9/"), Some(&after))
        .unwrap();
    let camera = cameras.get("hall").unwrap().unwrap();
    assert_eq!(camera.credentials.unwrap().password, after);
    let passwords = folder.path().join("state").join("passwords");
    assert_eq!(fs::read_dir(passwords).unwrap().count(), 1);
}
