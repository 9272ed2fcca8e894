//! OpenCV's `FileStorage`: a camera matrix and distortion coefficients under names that every
//! program chooses for itself.
//!
//! With `xi` it is `cv::omnidir` (`k1, k2, p1, p2`), else `cv::fisheye` (`k1` to `k4`) where the
//! file says so, or has four coefficients and says nothing. Five and more are an ordinary camera.

use serde_json::Value;

use super::{
    Camera, FormatError,
    camera_matrix::CameraMatrix,
    distortion::{Distortion, not_a_fisheye},
    fields::Fields,
};
use crate::native::NativeImage;
use crate::warning::{Warning, WarningCode};
use lookdown_lens::geometry::lens::{LensModel, Mei};

/// Names of the camera matrix that programs choose.
const MATRIX: [&str; 8] = [
    "camera_matrix",
    "cameraMatrix",
    "Camera_Matrix",
    "K",
    "M",
    "mtx",
    "intrinsic_matrix",
    "intrinsics",
];
/// Names of the distortion coefficients.
const COEFFICIENTS: [&str; 8] = [
    "distortion_coefficients",
    "distCoeffs",
    "Distortion_Coefficients",
    "D",
    "dist",
    "dist_coeffs",
    "dist_coeff",
    "distortion",
];
/// Names of the frame's width and height.
const SIZES: [(&str, &str); 4] = [
    ("image_width", "image_height"),
    ("image_Width", "image_Height"),
    ("imageWidth", "imageHeight"),
    ("width", "height"),
];
/// Names of the frame size as one field.
const SIZE_PAIRS: [&str; 4] = ["image_size", "imageSize", "img_size", "resolution"];
/// Fields that calibration programs store before they have a result.
const CORNERS: [&str; 2] = ["imagePoints", "image_points"];

/// Returns true for a file with any of the names by which OpenCV's files are known.
pub(super) fn is_storage(fields: &Fields<'_>) -> bool {
    let mut names = MATRIX.iter().chain(&CORNERS);
    names.any(|name| fields.has(name))
}

pub(super) fn read(fields: &Fields<'_>) -> Result<Camera, FormatError> {
    let Some(matrix) = present(fields, &MATRIX) else {
        return Err(fields.invalid(
            MATRIX[0],
            "it is missing: the file holds the corner points of a calibration, not its result",
        ));
    };
    let matrix = CameraMatrix::read(fields, matrix)?;
    let coefficients = present(fields, &COEFFICIENTS).unwrap_or(COEFFICIENTS[0]);
    let (lens, note) = if let Some(xi) = present(fields, &["xi", "Xi"]) {
        let [xi] = fields.exactly(xi, "xi alone")?;
        let [k1, k2, p1, p2] = fields.exactly(coefficients, "k1, k2, p1, p2")?;
        let lens = Mei {
            skew: matrix.skew,
            ..Mei::new(matrix.pinhole, xi, k1, k2, p1, p2)
        };
        (lens.into(), None)
    } else {
        without_xi(fields, matrix, coefficients)?
    };
    let mut camera = Camera::new(image(fields)?, lens);
    camera.notes.extend(note);
    Ok(camera)
}

fn without_xi(
    fields: &Fields<'_>,
    matrix: CameraMatrix,
    coefficients: &str,
) -> Result<(LensModel, Option<Warning>), FormatError> {
    let values = fields.numbers(coefficients)?;
    let (said, distortion) = said_distortion(fields)?;
    let lens = |distortion| matrix.lens(distortion, &values, fields, (said, coefficients));
    match distortion {
        Some(distortion) => Ok((lens(distortion)?, None)),
        None if values.len() == 4 => {
            let note = format!(
                "the file does not say which model {coefficients} belong to: its 4 numbers were \
                 taken for cv::fisheye"
            );
            let note = Warning::new(WarningCode::LensModelAssumed, note);
            Ok((lens(Distortion::Fisheye)?, Some(note)))
        }
        None => {
            let model = format!("a camera with {} coefficients", values.len());
            let refusal = fields.invalid(coefficients, not_a_fisheye(&model));
            lens(Distortion::RadialTangential)
                .map(|lens| (lens, None))
                .map_err(|_| refusal)
        }
    }
}

/// Returns the model that the file states, and the field that states it.
fn said_distortion(fields: &Fields<'_>) -> Result<(&'static str, Option<Distortion>), FormatError> {
    if let Some(key) = present(fields, &["distortion_model", "camera_model", "model"]) {
        let name = fields.text(key)?;
        let known = Distortion::of_name(name).ok_or_else(|| {
            fields.invalid(
                key,
                format!("it is {name:?}: fisheye or equidistant is read"),
            )
        })?;
        return Ok((key, Some(known)));
    }
    let flag = "fisheye_model";
    let distortion = match fields.map().get(flag) {
        None => None,
        Some(Value::Bool(false)) => Some(Distortion::RadialTangential),
        Some(value) if value.as_f64() == Some(0.0) => Some(Distortion::RadialTangential),
        Some(_) => Some(Distortion::Fisheye),
    };
    Ok((flag, distortion))
}

fn image(fields: &Fields<'_>) -> Result<Option<NativeImage>, FormatError> {
    if let Some((width, height)) = SIZES.iter().find(|(width, _)| fields.has(width)) {
        return fields.image(width, height).map(Some);
    }
    let pair = present(fields, &SIZE_PAIRS);
    pair.map(|key| fields.image_pair(key)).transpose()
}

fn present(fields: &Fields<'_>, names: &[&'static str]) -> Option<&'static str> {
    names.iter().copied().find(|name| fields.has(name))
}
