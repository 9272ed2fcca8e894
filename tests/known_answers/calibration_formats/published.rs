//! Published calibrations, in the files of their programs, project like the programs do.

use std::{convert::identity, fmt::Write};

use lookdown_lens::geometry::{Pixel, pixels::to_corner_origin};
use serde_json::Value;

use crate::calibration_formats::{camera, json, lens, ray};

fn published(name: &str) -> Value {
    let all = json("vectors/public_calibrations.json");
    let sets = all["sets"].as_array().unwrap();
    sets.iter().find(|set| set["name"] == name).unwrap().clone()
}

/// Asserts that the file projects the set's rays to its pixels.
#[track_caller]
fn assert_projects(content: &str, set: &Value, tolerance: f64, shown: fn(Pixel) -> Pixel) {
    let lens = lens(&camera(content.as_bytes(), 0));
    let rays = set["rays"].as_array().unwrap();
    let mut compared = 0;
    for (ray_fields, pixel) in rays.iter().zip(set["pixels"].as_array().unwrap()) {
        let (Some(u), Some(v)) = (pixel[0].as_f64(), pixel[1].as_f64()) else {
            continue;
        };
        // Some curves turn back before the last rays, which their programs project nevertheless.
        let Some(projected) = lens.project(&ray(ray_fields)) else {
            continue;
        };
        let off = (shown(projected) - Pixel::new(u, v)).norm();
        assert!(off <= tolerance, "{ray_fields}: off by {off} pixels");
        compared += 1;
    }
    assert!(compared >= 48, "only {compared} rays were compared");
}

fn numbers(value: &Value) -> String {
    let numbers = value.as_array().unwrap().iter().map(Value::to_string);
    numbers.collect::<Vec<_>>().join(", ")
}

fn pinhole(set: &Value) -> [&Value; 4] {
    let matrix = &set["K"];
    [&matrix[0][0], &matrix[1][1], &matrix[0][2], &matrix[1][2]]
}

fn matrix(set: &Value) -> String {
    let rows = set["K"].as_array().unwrap().iter();
    rows.map(numbers).collect::<Vec<_>>().join(", ")
}

#[test]
fn opencv_fisheye() {
    for name in ["opencv_test", "t265_cam0", "fiord"] {
        let set = published(name);
        let content = format!(
            "%YAML:1.0\n---\nimage_width: {}\nimage_height: {}\nfisheye_model: 1\n\
             K: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ {} ]\n\
             D: !!opencv-matrix\n   rows: 4\n   cols: 1\n   dt: d\n   data: [ {} ]\n",
            set["size"][0],
            set["size"][1],
            matrix(&set),
            numbers(&set["D"])
        );
        assert_projects(&content, &set, 1e-6, identity);
    }
}

#[test]
fn ros_fisheye_is_the_same_lens() {
    let set = published("fiord");
    let content = format!(
        "image_width: {}\nimage_height: {}\ncamera_name: ceiling\n\
         camera_matrix: {{rows: 3, cols: 3, data: [{}]}}\ndistortion_model: fisheye\n\
         distortion_coefficients: {{rows: 1, cols: 4, data: [{}]}}\n",
        set["size"][0],
        set["size"][1],
        matrix(&set),
        numbers(&set["D"])
    );
    assert_projects(&content, &set, 1e-6, identity);
}

#[test]
fn kalibr_pinhole_equidistant() {
    let set = published("t265_cam0");
    let [fu, fv, pu, pv] = pinhole(&set);
    let content = format!(
        "cam0:\n  camera_model: pinhole\n  distortion_coeffs: [{}]\n  distortion_model: equidistant\n  \
         intrinsics: [{fu}, {fv}, {pu}, {pv}]\n  resolution: {}\n",
        numbers(&set["D"]),
        set["size"]
    );
    assert_projects(&content, &set, 1e-6, identity);
}

#[test]
fn kalibr_omni() {
    let set = published("kalibr_wiki_omni");
    let [fu, fv, pu, pv] = pinhole(&set);
    let content = format!(
        "cam0:\n  camera_model: omni\n  distortion_coeffs: [{}]\n  distortion_model: radtan\n  \
         intrinsics: [{}, {fu}, {fv}, {pu}, {pv}]\n  resolution: {}\n",
        numbers(&set["D"]),
        set["xi"],
        set["size"]
    );
    assert_projects(&content, &set, 1e-6, identity);
}

#[test]
fn camodocal_mei() {
    let set = published("mynteye_mei");
    let [gamma1, gamma2, u0, v0] = pinhole(&set);
    let content = format!(
        "%YAML:1.0\n---\nmodel_type: MEI\ncamera_name: camera\nimage_width: {}\nimage_height: {}\n\
         mirror_parameters:\n   xi: {}\ndistortion_parameters:\n   k1: {}\n   k2: {}\n   p1: {}\n   \
         p2: {}\nprojection_parameters:\n   gamma1: {gamma1}\n   gamma2: {gamma2}\n   u0: {u0}\n   \
         v0: {v0}\n",
        set["size"][0],
        set["size"][1],
        set["xi"],
        set["D"][0],
        set["D"][1],
        set["D"][2],
        set["D"][3]
    );
    assert_projects(&content, &set, 1e-6, identity);
}

#[test]
fn ocamcalib() {
    for name in [
        "ocam_matsuren_1600x1600",
        "ocam_renmeng_1920x1208",
        "ocam_vivek_640x480",
        "ocam_metasurface_640x400",
    ] {
        let set = published(name);
        let parameters = &set["params"];
        let polynomial = parameters["polynomial"].as_array().unwrap();
        let mut content = format!(
            "#polynomial coefficients for the DIRECT mapping function\n\n{}",
            polynomial.len()
        );
        for coefficient in polynomial {
            write!(content, " {:e}", coefficient.as_f64().unwrap()).unwrap();
        }
        write!(
            content,
            " \n\n#inverse\n\n2 1.0 2.0\n\n#center: row and column\n\n{} {}\n\n#affine\n\n{} {} {}\n\n\
             #image size: height and width\n\n{} {}\n",
            parameters["cy"],
            parameters["cx"],
            parameters["c"],
            parameters["d"],
            parameters["e"],
            set["size"][1],
            set["size"][0]
        )
        .unwrap();
        // The reference projects with the approximate inverse polynomial.
        assert_unprojects(&content, &set);
    }
}

/// Asserts that the file unprojects the set's pixels to its rays.
#[track_caller]
fn assert_unprojects(content: &str, set: &Value) {
    let lens = lens(&camera(content.as_bytes(), 0));
    let pixels = set["inverse_pixels"].as_array().unwrap();
    for (pixel, expected) in pixels.iter().zip(set["inverse_rays"].as_array().unwrap()) {
        let pixel = Pixel::new(pixel[0].as_f64().unwrap(), pixel[1].as_f64().unwrap());
        let seen = lens.unproject(&pixel).unwrap();
        assert!(
            (seen - ray(expected)).norm() < 1e-6,
            "{pixel}: {seen} instead of {expected}"
        );
    }
}

#[test]
fn colmap_has_its_origin_at_the_corner_of_the_first_pixel() {
    for (name, model) in [
        ("aria", "OPENCV_FISHEYE"),
        ("simple_radial_fisheye", "SIMPLE_RADIAL_FISHEYE"),
        ("eucm_basalt_like", "EUCM"),
        ("fov", "FOV"),
    ] {
        let set = published(name);
        let content = format!(
            "# Camera list with one line of data per camera:\n7 {model} {} {} {}\n",
            set["size"][0],
            set["size"][1],
            numbers(&set["params"]).replace(',', "")
        );
        assert_projects(&content, &set, 1e-6, to_corner_origin);
    }
}

#[test]
fn basalt_double_sphere() {
    let set = published("tumvi_512_ds");
    let content = format!(
        r#"{{"value0": {{"intrinsics": [{{"camera_type": "ds", "intrinsics": {}}}],
            "resolution": [[512, 512]]}}}}"#,
        set["params"]
    );
    assert_projects(&content, &set, 1e-6, identity);
}

#[test]
fn moil_radii() {
    let set = published("moil_axis_2880");
    let content = crate::calibration_formats::fixture("calibrations/moil.json");
    let lens = lens(&camera(&content, 0));
    for (degrees, radius) in set["alpha_deg_to_r_px"].as_object().unwrap() {
        let theta = degrees.parse::<f64>().unwrap().to_radians();
        let ray = lookdown_lens::geometry::Ray::new(theta.sin(), 0.0, theta.cos());
        let pixel = lens.project(&ray).unwrap();
        assert!((pixel.x - 1439.0 - radius.as_f64().unwrap()).abs() < 1e-9);
    }
}
