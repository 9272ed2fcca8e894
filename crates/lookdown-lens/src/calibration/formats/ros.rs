//! ROS `camera_info`: the YAML of `camera_calibration_parsers`, or a message as `topic echo` prints
//! it.
//!
//! `equidistant` is OpenCV's fisheye (<https://github.com/ros2/common_interfaces>,
//! `distortion_models.hpp`), also written `fisheye` and `kannala_brandt`. `plumb_bob` describes no
//! fisheye, even under a camera name that says so.

use super::{
    Camera, FormatError, camera_matrix::CameraMatrix, distortion::Distortion, fields::Fields,
};
use crate::calibration::native::NativeImage;

pub(super) fn read(fields: &Fields<'_>) -> Result<Camera, FormatError> {
    let spelled = |spellings: [&'static str; 3]| {
        let present = spellings.into_iter().find(|key| fields.has(key));
        present.unwrap_or(spellings[0])
    };
    let matrix = CameraMatrix::read(fields, spelled(["camera_matrix", "K", "k"]))?;
    let coefficients = spelled(["distortion_coefficients", "D", "d"]);
    let name = fields.text("distortion_model")?;
    let distortion = Distortion::of_name(name).ok_or_else(|| {
        fields.invalid(
            "distortion_model",
            format!("it is {name:?}: equidistant (also called fisheye or kannala_brandt) is read"),
        )
    })?;
    let values = fields.numbers(coefficients)?;
    let lens = matrix.lens(
        distortion,
        &values,
        fields,
        ("distortion_model", coefficients),
    )?;
    Ok(Camera::new(image(fields)?, lens))
}

/// The frame size; hand-written files leave it out.
fn image(fields: &Fields<'_>) -> Result<Option<NativeImage>, FormatError> {
    for (width, height) in [("image_width", "image_height"), ("width", "height")] {
        if fields.has(width) {
            return fields.image(width, height).map(Some);
        }
    }
    Ok(None)
}
