//! `lookdown calibration`

use crate::{assert_fails_with, lookdown};

#[test]
fn circle_only_fit_names_its_assumptions() {
    let fitted = lookdown(
        &[
            "calibration",
            "fit",
            "samples/office.jpg",
            "--circle-only",
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

/// Draws a room of 6 by 5 by 2.8 meters as a tilted equidistant camera sees it: walls with doors, a
/// floor of tiles.
fn drawn_room(side: u32, focal: f64, tilt: f64) -> image::RgbImage {
    let center = f64::from(side) / 2.0 - 0.5;
    image::RgbImage::from_fn(side, side, |column, row| {
        let (mut sum, mut count) = (0_u32, 0_u32);
        for (dx, dy) in [(-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)] {
            let (x, y) = (
                f64::from(column) + dx - center,
                f64::from(row) + dy - center,
            );
            let theta = x.hypot(y) / focal;
            let azimuth = y.atan2(x);
            let [x, y, z] = [
                theta.sin() * azimuth.cos(),
                theta.sin() * azimuth.sin(),
                theta.cos(),
            ];
            let (x, z) = (
                x * tilt.cos() + z * tilt.sin(),
                z * tilt.cos() - x * tilt.sin(),
            );
            let (turn_sin, turn_cos) = 0.3_f64.sin_cos();
            let (x, y) = (x * turn_cos - y * turn_sin, x * turn_sin + y * turn_cos);
            count += 1;
            if theta < 1.5 {
                sum += shade(x, y, z);
            }
        }
        let value = u8::try_from(sum / count).unwrap();
        image::Rgb([value; 3])
    })
}

/// Brightness of the wall, door or tile that a ray meets.
fn shade(x: f64, y: f64, z: f64) -> u32 {
    let to_x = if x > 0.0 { 3.4 / x } else { -2.6 / x };
    let to_y = if y > 0.0 { 2.2 / y } else { -2.8 / y };
    let to_z = if z > 0.0 { 2.6 / z } else { f64::INFINITY };
    let reach = to_x.min(to_y).min(to_z);
    let [x, y, z] = [x * reach, y * reach, z * reach];
    let cell = |value: f64, size: f64| (value / size).floor().rem_euclid(2.0) > 0.5;
    if reach == to_z {
        return if cell(x, 0.7) == cell(y, 0.55) {
            150
        } else {
            110
        };
    }
    let (along, base) = if reach == to_x { (y, 190) } else { (x, 220) };
    if (0.5..2.1).contains(&z) && cell(along + 9.3, 0.8) {
        base - 120
    } else {
        base
    }
}

#[test]
fn fit_finds_lens_and_level_of_a_drawn_room() {
    let folder = tempfile::TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (frame, out, preview) = (path("room.png"), path("room.json"), path("preview.jpg"));
    drawn_room(700, 220.0, 0.15).save(&frame).unwrap();
    let fit = [
        "calibration",
        "fit",
        &frame,
        "--height",
        "2.6",
        "--out",
        &out,
    ];
    let fitted = lookdown(&[&fit[..], &["--preview", &preview]].concat(), &[]);
    let said = String::from_utf8_lossy(&fitted.stderr);
    assert!(fitted.status.success(), "{said}");
    assert!(
        said.contains("measured") && said.contains("given"),
        "{said}"
    );
    let found: serde_json::Value = serde_json::from_slice(&std::fs::read(&out).unwrap()).unwrap();
    let focal = found["lens"]["fx"].as_f64().unwrap();
    assert!((focal / 220.0 - 1.0).abs() < 0.02, "{found}");
    let up = &found["mount"]["world_up"];
    let tilt = up[0]
        .as_f64()
        .unwrap()
        .hypot(up[1].as_f64().unwrap())
        .asin();
    assert!((tilt - 0.15).abs() < 0.02, "{found}");
    assert_eq!(found["sources"]["height_m"]["source"], "given");
    assert_room_is_drawn(&image::open(&preview).unwrap().to_rgb8());
    let checked = lookdown(&["calibration", "check", &out], &[]);
    let report = String::from_utf8(checked.stdout).unwrap();
    assert!(report.contains("world_up: measured"), "{report}");
}

/// Returns the pixel of the preview that shows a place of the room of [`drawn_room`], meters from
/// the camera, in the frame of 700 by 700 pixels with a focal length of 220 and a tilt of 0.15.
fn preview_pixel([x, y, z]: [f64; 3]) -> [f64; 2] {
    let ((turn_sin, turn_cos), (sin, cos)) = (0.3_f64.sin_cos(), 0.15_f64.sin_cos());
    let (x, y) = (x * turn_cos + y * turn_sin, y * turn_cos - x * turn_sin);
    let (x, z) = (x * cos - z * sin, x * sin + z * cos);
    let (theta, azimuth) = (x.hypot(y).atan2(z), y.atan2(x));
    // The frame is below two rows of 480 pixels, in the middle of 1920 pixels.
    [
        610.0 + 350.0 + 220.0 * theta * azimuth.cos(),
        960.0 + 350.0 + 220.0 * theta * azimuth.sin(),
    ]
}

/// Asserts the colors of edges, horizon and nadir in the preview of the gray room.
#[track_caller]
fn assert_room_is_drawn(preview: &image::RgbImage) {
    type IsColor = fn([i32; 3]) -> bool;
    let is_blue: IsColor = |[red, green, blue]| green.min(blue) > red + 40;
    let is_yellow: IsColor = |[red, green, blue]| red.min(green) > blue + 40;
    let is_pink: IsColor = |[red, green, blue]| red.min(blue) > green + 40;
    let is_green: IsColor = |[red, green, blue]| green > red.max(blue) + 30;
    let is_white: IsColor = |color| color.iter().all(|value| *value > 240);
    assert_eq!((preview.width(), preview.height()), (1920, 1660));
    let share = |places: &[[f64; 3]], is_color: IsColor| {
        let is_near = |place: &&[f64; 3]| {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a pixel of the preview"
            )]
            let [x, y] = preview_pixel(**place).map(|value| value as u32);
            let near = (0..9).map(|index| preview.get_pixel(x + index % 3 - 1, y + index / 3 - 1));
            near.into_iter()
                .any(|pixel| is_color(pixel.0.map(i32::from)))
        };
        let found = places.iter().filter(is_near).count();
        100 * found / places.len()
    };
    let line = |from: [f64; 3], to: [f64; 3]| -> Vec<[f64; 3]> {
        let steps = (0..=20).map(|step| f64::from(step) / 20.0);
        let between =
            |share: f64| [0, 1, 2].map(|axis| from[axis] + share * (to[axis] - from[axis]));
        steps.map(between).collect()
    };
    let door = line([3.4, 0.3, 0.7], [3.4, 0.3, 1.9]);
    let along_y = line([3.4, -2.4, 2.6], [3.4, 1.8, 2.6]);
    let along_x = line([-2.2, 2.2, 2.6], [3.0, 2.2, 2.6]);
    let horizon = line([3.0, -2.0, 0.0], [3.0, 0.5, 0.0]);
    assert!(share(&door, is_blue) > 60);
    let colors = [is_yellow, is_pink].map(|color| [share(&along_x, color), share(&along_y, color)]);
    let [[a, b], [c, d]] = colors;
    assert!(a.min(d) > 60 || b.min(c) > 60, "{colors:?}");
    assert!(share(&horizon, is_green) > 90);
    assert_eq!(share(&[[0.0, 0.0, 1.0]], is_white), 100);
}

/// Adds noise of up to some levels, the same in each run.
fn add_noise(frame: &mut image::RgbImage, levels: u8) {
    let mut state = 1_u32;
    for pixel in frame.pixels_mut() {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = u8::try_from((state >> 16) % (2 * u32::from(levels) + 1)).unwrap();
        for value in &mut pixel.0 {
            *value = value.saturating_add(noise).saturating_sub(levels);
        }
    }
}

#[test]
fn enlarged_noisy_frame_is_fitted() {
    let folder = tempfile::TempDir::new().unwrap();
    let frame = folder.path().join("room.png");
    let mut small = drawn_room(260, 220.0 * 260.0 / 700.0, 0.15);
    add_noise(&mut small, 18);
    image::imageops::resize(&small, 910, 910, image::imageops::FilterType::CatmullRom)
        .save(&frame)
        .unwrap();
    let fitted = lookdown(&["calibration", "fit", frame.to_str().unwrap()], &[]);
    assert!(fitted.status.success(), "{fitted:?}");
    let found: serde_json::Value = serde_json::from_slice(&fitted.stdout).unwrap();
    let focal = found["lens"]["fx"].as_f64().unwrap();
    assert!((focal / 286.0 - 1.0).abs() < 0.02, "{found}");
}

#[test]
fn frame_without_edges_is_refused_with_a_remedy() {
    let folder = tempfile::TempDir::new().unwrap();
    let gray = folder.path().join("gray.png");
    image::RgbImage::from_pixel(64, 64, image::Rgb([90; 3]))
        .save(&gray)
        .unwrap();
    let fitted = lookdown(&["calibration", "fit", gray.to_str().unwrap()], &[]);
    assert_fails_with(&fitted, &["edges", "lights on", "--circle-only"]);
}

#[test]
fn frames_without_a_lens_circle_are_not_fitted() {
    let folder = tempfile::TempDir::new().unwrap();
    let bright = folder.path().join("bright.png");
    image::RgbImage::from_pixel(64, 64, image::Rgb([200; 3]))
        .save(&bright)
        .unwrap();
    let fitted = lookdown(
        &[
            "calibration",
            "fit",
            "--circle-only",
            bright.to_str().unwrap(),
        ],
        &[],
    );
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
    let calibration = lookdown_calibration::Calibration::read(native.as_ref()).unwrap();
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
    let limits = lookdown_imaging::decode::DecodeLimits::default();
    let frame = lookdown_imaging::decode::decode(&std::fs::read(out).unwrap(), &limits)
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
    let limits = lookdown_imaging::decode::DecodeLimits::default();
    let preview = lookdown_imaging::decode::decode(&std::fs::read(out).unwrap(), &limits);
    let preview = preview.unwrap().frame;
    // Between the rings and lines of the drawing the frame is black.
    let black = (0..240)
        .flat_map(|y| (0..960).map(move |x| (x, y)))
        .filter(|&(x, y)| preview.pixel(x, y).iter().all(|&value| value < 30));
    assert!(black.count() > 100_000);
}
