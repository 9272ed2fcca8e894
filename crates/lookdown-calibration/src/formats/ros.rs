//! ROS `camera_info`: the YAML of `camera_calibration_parsers`, or a message as `topic echo` prints
//! it.
//!
//! `equidistant` is OpenCV's fisheye (<https://github.com/ros2/common_interfaces>,
//! `distortion_models.hpp`), also written `fisheye` and `kannala_brandt`. `plumb_bob` describes no
//! fisheye, even under a camera name that says so.

use super::{
    Camera, FormatError,
    camera_matrix::{CameraMatrix, Distortion},
    fields::Fields,
};
use crate::native::NativeImage;

pub(super) fn read(fields: &Fields<'_>) -> Result<Camera, FormatError> {
    let spelled = |spellings: [&'static str; 3]| {
        let present = spellings.into_iter().find(|key| fields.has(key));
        present.unwrap_or(spellings[0])
    };
    let mut matrix = CameraMatrix::read(fields, spelled(["camera_matrix", "K", "k"]))?;
    let region = region(fields)?;
    if let Some((_, [x_offset, y_offset])) = region {
        matrix.pinhole[2] -= x_offset;
        matrix.pinhole[3] -= y_offset;
    }
    let coefficients = spelled(["distortion_coefficients", "D", "d"]);
    let name = fields.text("distortion_model")?;
    let distortion = Distortion::from_name(name).ok_or_else(|| {
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
    let of_region = region.map(|(size, _)| size);
    let image = of_region.map_or_else(|| image(fields), |size| Ok(Some(size)))?;
    Ok(Camera::new(image, lens))
}

/// The part of the sensor that the frames show, if they do not show all of it: its size and its
/// corner. The matrix is that of the whole sensor. Frames of another size, as by binning, are
/// scaled as those of every calibration.
fn region(fields: &Fields<'_>) -> Result<Option<(NativeImage, [f64; 2])>, FormatError> {
    if !fields.has("roi") {
        return Ok(None);
    }
    let roi = fields.child("roi")?;
    let offset = roi.optional(["x_offset", "y_offset"])?;
    let size: [f64; 2] = roi.optional(["width", "height"])?;
    match (size.contains(&0.0), offset == [0.0, 0.0]) {
        (true, true) => Ok(None),
        (true, false) => {
            let problem =
                "the frames show a part of the sensor: give the width and the height of it";
            Err(roi.invalid("width", problem))
        }
        (false, _) => Ok(Some((roi.image("width", "height")?, offset))),
    }
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

#[cfg(test)]
mod tests {
    use crate::Calibration;
    use crate::CalibrationFile;

    fn read(size: &str, rest: &str) -> Result<Calibration, String> {
        let content = format!(
            "{size}\ndistortion_model: equidistant\nD: [0.0153, -0.0043, -0.0011, 0.0001]\n\
             K: [203.9, 0.0, 631.065, 0.0, 203.9, 375.69, 0.0, 0.0, 1.0]\n{rest}\n"
        );
        let file = CalibrationFile::parse(content.as_bytes()).map_err(|e| e.to_string())?;
        let (_, calibration) = file.calibrations("hall", content.as_bytes()).remove(0);
        calibration.map_err(|error| error.to_string())
    }

    #[test]
    fn a_part_of_the_sensor_moves_the_principal_point() {
        let part = "roi: {x_offset: 320, y_offset: 200, height: 400, width: 640}";
        for size in ["height: 400\nwidth: 640", "height: 800\nwidth: 1280"] {
            let calibration = read(size, part).unwrap();
            assert_eq!(calibration.image_size(), (640, 400));
            let center = calibration.lens().principal_point();
            let expected = nalgebra::Point2::new(311.065, 175.69);
            assert!((center - expected).norm() < 1e-9, "{center}");
        }
        let refused = read(
            "height: 400\nwidth: 640",
            "roi: {x_offset: 320, y_offset: 200}",
        );
        assert!(refused.unwrap_err().starts_with("roi.width: "));
        for whole in ["", "roi: {x_offset: 0, y_offset: 0, height: 0, width: 0}"] {
            let calibration = read("height: 800\nwidth: 1280", whole).unwrap();
            assert_eq!(calibration.image_size(), (1280, 800));
        }
    }
}
