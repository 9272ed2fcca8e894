use std::{fs, path::Path};

use lookdown_common::{ServerEntry, parse_toml};
use serde::Deserialize;

use super::CameraEntry;
use crate::{Location, WatchEntry};

/// A file of cameras.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(clippy::struct_field_names, reason = "keys of the file")]
struct Cameras {
    #[serde(default)]
    upstream: ServerEntry,
    #[serde(default)]
    camera_defaults: CameraEntry,
    #[serde(default)]
    cameras: Vec<CameraEntry>,
}

fn error_of(text: &str) -> String {
    loaded(text).unwrap_err()
}

fn loaded(text: &str) -> Result<crate::WatchOptions, String> {
    let file: Result<Cameras, _> = parse_toml(text, "the settings file", "docs/watch.md");
    let file = file.map_err(|error| error.to_string())?;
    let entry = WatchEntry {
        server: file.upstream,
        defaults: file.camera_defaults,
        cameras: file.cameras,
    };
    entry.check().map_err(|error| error.to_string())
}

#[test]
fn defaults_apply_to_every_camera() {
    let options = loaded(
        r#"
        [camera_defaults]
        profile = "fast"
        every = "500ms"
        parameters = { score_threshold = 0.4 }
        [[cameras]]
        name = "hall"
        url = "http://10.0.0.8/snap.jpg"
        calibration = "ceiling"
        [[cameras]]
        name = "gate"
        url = "rtsp://viewer:secret@10.0.0.9/s1"
        every = "2s"
        motion = false
        follow = false
        "#,
    )
    .unwrap();
    assert_eq!(options.server.url.as_str(), "http://127.0.0.1:8080/");
    let [hall, gate] = options.cameras.as_slice() else {
        panic!("two cameras")
    };
    assert_eq!(hall.every().as_millis(), 500);
    let query = |camera: &crate::Camera| {
        let pairs = camera.parameters.iter();
        let pairs = pairs.map(|(key, value)| format!("{key}={value}"));
        pairs.collect::<Vec<_>>().join("&")
    };
    assert_eq!(
        query(hall),
        "camera=hall&calibration=ceiling&profile=fast&motion=true&follow=true&score_threshold=0.4"
    );
    assert_eq!(
        query(gate),
        "camera=gate&profile=fast&motion=false&follow=false&score_threshold=0.4"
    );
    assert_eq!(gate.every().as_secs(), 2);
    assert!(matches!(&gate.location, Location::Rtsp(url) if url.username().is_empty()));
    assert_eq!(gate.credentials.as_ref().unwrap().user, "viewer");
}

#[test]
fn errors_name_the_field_the_value_and_the_remedy() {
    for (text, expected) in [
        (
            "[[cameras]]\nname='a'",
            "cameras[0].url: the source of the frames is missing: give a URL, a folder or a file",
        ),
        (
            "[[cameras]]\nurl='http://c/'",
            "cameras[0].name: a name is missing: give a name or a calibration",
        ),
        (
            "[[cameras]]\nname='a'\nurl='http://c/'\nevery='1 parsec'",
            "cameras[0].every: \"1 parsec\" is not a duration from 0.04 s to 3600 s: write it like 10s or 500ms",
        ),
        (
            "[[cameras]]\nname='a'\nurl='http://c/'\n[[cameras]]\nname='a'\nurl='http://d/'",
            "cameras[1].name: \"a\" is the name of an earlier camera: give each camera its own",
        ),
        (
            "[[cameras]]\nname='a'\nurl='http://c/'\nparameters={camera='b'}",
            "cameras[0].parameters: \"camera\" does not belong here: it is a key of the camera, or is set for each frame",
        ),
        (
            "[upstream]\nurl='ftp://x:y@host'\n[[cameras]]\nname='a'\nurl='http://c/'",
            "upstream.url: \"host\" is not a URL of a server: write it like http://127.0.0.1:8080",
        ),
        (
            "[[cameras]]\nname='a'\nurl='http://c/'\nhwaccel='-x y'",
            "cameras[0].hwaccel: \"-x y\" is not a method of `ffmpeg -hwaccels`: use auto, or one of that list",
        ),
        (
            "[[cameras]]\nname='a'\nurl='http://c/'\nevery='20s'\nstall_after='10s'",
            "cameras[0].stall_after: \"10s\" is not longer than the interval between two frames: raise it",
        ),
        (
            "[[cameras]]\nname='a'\nurl='http://u:p@c/'\nuser='v'",
            "cameras[0].user: the URL has credentials as well: remove them there, or remove user and password_file",
        ),
    ] {
        assert_eq!(error_of(text), expected);
    }
}

#[test]
fn unknown_keys_are_refused_with_their_line() {
    let error = error_of("[[cameras]]\nname='a'\nurl='http://c/'\nwidht='1s'");
    assert!(error.starts_with("cameras[0]"), "{error}");
    assert!(error.contains("unknown field `widht`"), "{error}");
    assert!(error.contains("(line 4): correct"), "{error}");
    let error = error_of("[[cameras]]\nname='a'\nurl='http://c/'\nfps=5");
    assert!(error.contains("; use every, the time between"), "{error}");
}

#[test]
fn a_wrong_url_is_refused_without_its_password() {
    for url in ["rtsp://u:geheim@", "ftp://u:geheim@c/x"] {
        let error = error_of(&format!("[[cameras]]\nname='a'\nurl='{url}'"));
        assert!(error.starts_with("cameras[0].url: it"), "{error}");
        assert!(!error.contains("geheim"), "{error}");
    }
}

#[test]
fn a_password_is_the_first_line_of_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let password = folder.path().join("password");
    let text = format!(
        "[[cameras]]\nname='a'\nurl='http://c/'\nuser='v'\npassword_file={:?}",
        password.display().to_string()
    );
    assert!(error_of(&text).contains("password_file"), "it is missing");
    fs::write(&password, "first\n").unwrap();
    let first = loaded(&text).unwrap();
    assert!(!format!("{first:?}").contains("first"));
    fs::write(&password, "second\n").unwrap();
    assert_ne!(first, loaded(&text).unwrap(), "the camera is started again");
    assert!(Path::new(&password).exists());
}
