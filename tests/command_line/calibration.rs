//! `lookdown calibration`

use crate::{assert_fails_with, lookdown};

#[test]
fn fit_writes_a_calibration_and_names_its_assumptions() {
    let fitted = lookdown(
        &[
            "calibration",
            "fit",
            "samples/office.jpg",
            "--id",
            "office",
            "--height",
            "2.8",
        ],
        &[],
    );
    assert!(fitted.status.success(), "{fitted:?}");
    let said = String::from_utf8_lossy(&fitted.stderr);
    assert!(said.contains("not measured"), "{said}");
    let found: serde_json::Value = serde_json::from_slice(&fitted.stdout).unwrap();
    let truth = std::fs::read("samples/calibrations/office.json").unwrap();
    let truth: serde_json::Value = serde_json::from_slice(&truth).unwrap();
    assert_eq!(
        (&found["id"], &found["mount"]["height_m"]),
        (&"office".into(), &2.8.into())
    );
    let radius = |lens: &serde_json::Value| {
        lens["focal"].as_f64().unwrap() * lens["max_theta"].as_f64().unwrap()
    };
    let allowed = 0.005 * radius(&truth["lens"]);
    assert!(
        (radius(&found["lens"]) - radius(&truth["lens"])).abs() < allowed,
        "{found}"
    );
    for center in ["cx", "cy"] {
        let off = found["lens"][center].as_f64().unwrap() - truth["lens"][center].as_f64().unwrap();
        assert!(off.abs() < allowed, "{center}: {found}");
    }
}

#[test]
fn frames_without_a_lens_circle_are_not_fitted() {
    let folder = tempfile::TempDir::new().unwrap();
    let bright = folder.path().join("bright.png");
    image::RgbImage::from_pixel(64, 64, image::Rgb([200; 3]))
        .save(&bright)
        .unwrap();
    let fitted = lookdown(&["calibration", "fit", bright.to_str().unwrap()], &[]);
    let said = String::from_utf8(fitted.stderr).unwrap();
    assert_eq!(fitted.status.code(), Some(1), "{said}");
    assert!(fitted.stdout.is_empty());
    let said: Vec<_> = said.lines().collect();
    assert!(
        said[0].ends_with("bright.png: no lens circle found"),
        "{said:?}"
    );
    assert!(said[1].contains("give brighter frames"), "{said:?}");
}

#[test]
fn calibrations_of_other_programs_are_checked_and_converted() {
    let camchain = "tests/fixtures/calibrations/kalibr_camchain.yaml";
    let checked = lookdown(&["calibration", "check", camchain], &[]);
    assert!(checked.status.success());
    let report = String::from_utf8(checked.stdout).unwrap();
    for expected in [
        "Kalibr camchain, 4 cameras",
        "calibration  kalibr_camchain-cam2",
        "  lens       double_sphere",
        "  frame      752×480 pixels",
    ] {
        assert!(report.contains(expected), "{report}");
    }

    let several = lookdown(&["calibration", "convert", camchain], &[]);
    assert_fails_with(&several, &["--camera", "cam0, cam1, cam2, cam3"]);
    let folder = tempfile::tempdir().unwrap();
    let native = folder.path().join("hall.json");
    let native = native.to_str().unwrap();
    let arguments = ["--camera", "cam0", "--id", "hall", "--out", native];
    let converted = lookdown(
        &[&["calibration", "convert", camchain][..], &arguments].concat(),
        &[],
    );
    assert!(converted.status.success());
    let calibration = lookdown_lens::calibration::Calibration::read(native.as_ref()).unwrap();
    assert_eq!(calibration.id().as_str(), "hall");
    assert_eq!(calibration.image_size(), (512, 512));
}

#[test]
fn an_unusable_calibration_is_explained_and_exits_with_1() {
    let file = "tests/fixtures/calibrations/ros_plumb_bob_called_fisheye.yaml";
    let output = lookdown(&["calibration", "check", file], &[]);
    assert_eq!(output.status.code(), Some(1));
    let report = String::from_utf8(output.stdout).unwrap();
    assert!(
        report.contains("refused    distortion_model: it is plumb_bob"),
        "{report}"
    );
}

#[test]
fn the_frame_size_is_an_option_only_if_the_file_has_none() {
    let file = "tests/fixtures/calibrations/py_ocamcalib.json";
    let arguments = ["calibration", "check", file, "--size", "1600x1600"];
    let report = String::from_utf8(lookdown(&arguments, &[]).stdout).unwrap();
    assert!(report.contains("  frame      1600×1600 pixels"), "{report}");
    let file = "tests/fixtures/calibrations/woodscape.json";
    let output = lookdown(&["calibration", "check", file, "--size", "640x480"], &[]);
    assert_fails_with(&output, &["--size", "1280x966"]);
}

#[test]
fn a_preview_shows_the_lens_in_the_frame() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("preview.jpg");
    let output = lookdown(
        &[
            "calibration",
            "check",
            "samples/calibrations/office.json",
            "--preview",
            "samples/office.jpg",
            "--out",
            out.to_str().unwrap(),
        ],
        &[],
    );
    assert!(output.status.success());
    let limits = lookdown_detect::imaging::decode::DecodeLimits::default();
    let frame = lookdown_detect::imaging::decode::decode(&std::fs::read(out).unwrap(), &limits)
        .unwrap()
        .frame;
    assert_eq!((frame.width(), frame.height()), (960, 960));
    // The rim is red at the left edge of the circle.
    let start = 3 * (480 * 960 + 1);
    let [red, green, blue] = [0, 1, 2].map(|channel| frame.pixels()[start + channel]);
    assert!(
        red > 180 && green < 140 && blue < 140,
        "{red} {green} {blue}"
    );
}

#[test]
fn zones_and_masks_are_listed_and_drawn_in_the_preview() {
    let folder = tempfile::tempdir().unwrap();
    let [file, out] = ["office.json", "preview.jpg"].map(|name| {
        let path = folder.path().join(name);
        path.to_str().unwrap().to_owned()
    });
    let office = std::fs::read_to_string("samples/calibrations/office.json").unwrap();
    let areas = r#""zones": [{"name": "desk", "frame_px": [[300, 300], [600, 300], [600, 600]]},
                             {"name": "below", "floor_m": [[-1, -1], [1, -1], [1, 1], [-1, 1]]}],
                   "masks": [{"frame_px": [[0, 0], [960, 0], [960, 240], [0, 240]]}],"#;
    std::fs::write(&file, office.replacen('{', &format!("{{{areas}"), 1)).unwrap();
    let preview = ["--preview", "samples/office.jpg", "--out", &out];
    let output = lookdown(
        &[&["calibration", "check", &file][..], &preview].concat(),
        &[],
    );
    let report = String::from_utf8(output.stdout).unwrap();
    for line in [
        "  zones      desk (in the frame), below (on the floor)\n",
        "  masks      1, which hide 25.0 % of the frame\n",
    ] {
        assert!(report.contains(line), "{report}");
    }
    let limits = lookdown_detect::imaging::decode::DecodeLimits::default();
    let picture = lookdown_detect::imaging::decode::decode(&std::fs::read(out).unwrap(), &limits);
    let picture = picture.unwrap().frame;
    // Between the rings and lines of the drawing the frame is black.
    let black = (0..240)
        .flat_map(|y| (0..960).map(move |x| (x, y)))
        .filter(|&(x, y)| picture.pixel(x, y).iter().all(|&value| value < 30));
    assert!(black.count() > 100_000);
}
