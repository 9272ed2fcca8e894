//! OpenCV's `FileStorage`: a camera matrix and distortion coefficients under names that every
//! program chooses for itself.
//!
//! With `xi` it is `cv::omnidir` (`k1, k2, p1, p2`), else `cv::fisheye` (`k1` to `k4`) where the
//! file says so, or has four coefficients and says nothing. Five and more are an ordinary camera.
//!
//! Files of several cameras number the names (`K1`, `camera_matrix_2`), call them left and right,
//! or have a camera in each of their fields.

use serde_json::{Map, Value};

use super::{
    Camera, FileCamera, FormatError,
    camera_file::{alone, named},
    camera_matrix::CameraMatrix,
    distortion::{Distortion, not_a_fisheye},
    fields::Fields,
};
use crate::native::NativeImage;
use crate::warning::{Warning, WarningCode};
use lookdown_lens::geometry::lens::{LensModel, Mei};

/// Names of the camera matrix that programs choose.
const MATRIX: [&str; 9] = [
    "camera_matrix",
    "cameraMatrix",
    "Camera_Matrix",
    "CameraMatrix",
    "K",
    "M",
    "mtx",
    "intrinsic_matrix",
    "intrinsics",
];
/// Names of the distortion coefficients.
const COEFFICIENTS: [&str; 9] = [
    "distortion_coefficients",
    "distCoeffs",
    "DistCoeffs",
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

/// Names of the cameras in a file of several.
const SIDES: [&str; 13] = [
    "0", "1", "2", "3", "4", "left", "right", "Left", "Right", "l", "r", "L", "R",
];

/// Returns true for a file with any of the names by which OpenCV's files are known.
pub(super) fn is_storage(fields: &Fields<'_>) -> bool {
    let mut entries = fields.map().values().filter_map(Value::as_object);
    has_matrix(fields.map())
        || CORNERS.iter().any(|name| fields.has(name))
        || !sides(fields).is_empty()
        || entries.any(has_matrix)
}

fn has_matrix(map: &Map<String, Value>) -> bool {
    MATRIX.iter().any(|name| map.contains_key(*name))
}

/// The cameras of the file that have a matrix of their own.
fn sides(fields: &Fields<'_>) -> Vec<&'static str> {
    // A number under such a name is a coefficient.
    let is_matrix = |key: &str| fields.numbers(key).is_ok_and(|numbers| numbers.len() == 9);
    let has_matrix = |side: &&str| present(fields, &MATRIX, side).is_some_and(is_matrix);
    SIDES.into_iter().filter(has_matrix).collect()
}

pub(super) fn read(fields: &Fields<'_>) -> Vec<FileCamera> {
    let is_camera = |entry: &Value| entry.as_object().is_some_and(has_matrix);
    if has_matrix(fields.map()) {
        return alone(read_camera(fields, ""));
    }
    let mut cameras = named(fields, is_camera, |camera| read_camera(camera, ""));
    for side in sides(fields) {
        cameras.push(FileCamera {
            name: Some(side.to_owned()),
            camera: read_camera(fields, side),
        });
    }
    if cameras.is_empty() {
        return alone(read_camera(fields, ""));
    }
    cameras
}

fn read_camera(fields: &Fields<'_>, side: &str) -> Result<Camera, FormatError> {
    let Some(matrix) = present(fields, &MATRIX, side) else {
        return Err(fields.invalid(
            MATRIX[0],
            "it is missing: the file holds the corner points of a calibration, not its result",
        ));
    };
    let matrix = CameraMatrix::read(fields, matrix)?;
    let coefficients = present(fields, &COEFFICIENTS, side).unwrap_or(COEFFICIENTS[0]);
    let (lens, note) = if let Some(xi) = present(fields, &["xi", "Xi"], side) {
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
    let mut camera = Camera::new(image(fields, side)?, lens);
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
fn said_distortion<'a>(fields: &Fields<'a>) -> Result<(&'a str, Option<Distortion>), FormatError> {
    if let Some(key) = present(fields, &["distortion_model", "camera_model", "model"], "") {
        let name = fields.text(key)?;
        let known = Distortion::from_name(name).ok_or_else(|| {
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

/// The frame size, which the cameras of a file may share.
fn image(fields: &Fields<'_>, side: &str) -> Result<Option<NativeImage>, FormatError> {
    for side in [side, ""] {
        for (width, height) in SIZES {
            let keys = present(fields, &[width], side).zip(present(fields, &[height], side));
            if let Some((width, height)) = keys {
                return fields.image(width, height).map(Some);
            }
        }
        if let Some(key) = present(fields, &SIZE_PAIRS, side) {
            return fields.image_pair(key).map(Some);
        }
    }
    Ok(None)
}

/// The first of the names that the file has: as it is, or joined with that of a camera.
fn present<'a>(fields: &Fields<'a>, names: &[&str], side: &str) -> Option<&'a str> {
    let spellings = |name: &&str| {
        [
            format!("{name}{side}"),
            format!("{name}_{side}"),
            format!("{side}_{name}"),
            format!("{side}{name}"),
        ]
    };
    let mut spelled = names.iter().flat_map(spellings);
    spelled.find_map(|key| Some(fields.map().get_key_value(&key)?.0.as_str()))
}
