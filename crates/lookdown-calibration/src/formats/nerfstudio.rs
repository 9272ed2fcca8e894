//! `transforms.json` of nerfstudio and instant-ngp: `fl_x fl_y cx cy w h k1 … k4` for all frames,
//! or in each frame (<https://docs.nerf.studio/quickstart/data_conventions.html>).
//!
//! `camera_model` is one of COLMAP's names, or instant-ngp's `is_fisheye` is true. As in COLMAP the
//! pixel coordinates begin at the corner of the first pixel.

use lookdown_lens::geometry::{
    Pixel,
    lens::{KannalaBrandt, Rectilinear},
    pixels::to_pixel_center,
};
use serde_json::Value;

use super::{
    Camera, FileCamera, FormatError,
    camera_file::{MAX_CAMERAS, alone},
    camera_matrix::{Distortion, are_all_zero, not_a_fisheye},
    fields::Fields,
};

/// The fields that make a camera; each is that of the file, else that of the frame.
const INTRINSICS: [&str; 12] = [
    "camera_model",
    "is_fisheye",
    "fl_x",
    "fl_y",
    "cx",
    "cy",
    "w",
    "h",
    "k1",
    "k2",
    "k3",
    "k4",
];

/// The different cameras of the frames, in their order.
pub(super) fn read(fields: &Fields<'_>) -> Vec<FileCamera> {
    let mut seen: Vec<Vec<Option<&Value>>> = Vec::new();
    let mut cameras = Vec::new();
    for frame in fields.entries("frames").flatten() {
        let values = INTRINSICS
            .map(|key| fields.map.get(key).or(frame.map.get(key)))
            .to_vec();
        if !seen.contains(&values) && cameras.len() <= MAX_CAMERAS {
            seen.push(values);
            let camera = read_camera(|key| if fields.has(key) { fields } else { &frame });
            cameras.push(FileCamera { name: None, camera });
        }
    }
    if cameras.is_empty() {
        return alone(read_camera(|_| fields));
    }
    cameras
}

fn read_camera<'a>(with: impl Fn(&str) -> &'a Fields<'a>) -> Result<Camera, FormatError> {
    let number = |key: &str| with(key).number(key);
    let fx = number("fl_x")?;
    let fy = if with("fl_y").has("fl_y") {
        number("fl_y")?
    } else {
        fx
    };
    let center = Pixel::new(number("cx")?, number("cy")?);
    let center = to_pixel_center(center);
    let pinhole = [fx, fy, center.x, center.y];
    let image = with("w").image("w", "h")?;
    let k = ["k1", "k2", "k3", "k4"].map(|key| with(key).number_or(key, 0.0));
    let [k1, k2, k3, k4] = k;
    let k = [k1?, k2?, k3?, k4?];
    let key = "camera_model";
    let model = if with(key).has(key) {
        with(key).text(key)?
    } else {
        ""
    };
    let is_fisheye = with("is_fisheye").map.get("is_fisheye") == Some(&Value::Bool(true));
    if is_fisheye || Distortion::from_name(model) == Some(Distortion::Fisheye) {
        return Ok(Camera::new(Some(image), KannalaBrandt::new(pinhole, k)));
    }
    let is_pinhole = ["", "PINHOLE", "SIMPLE_PINHOLE", "OPENCV"].contains(&model);
    if !(is_pinhole && are_all_zero(&k)) {
        let name = if model.is_empty() {
            "a camera without is_fisheye"
        } else {
            model
        };
        return Err(with(key).invalid(key, not_a_fisheye(name)));
    }
    Ok(Camera::new(Some(image), Rectilinear::new(pinhole)))
}
