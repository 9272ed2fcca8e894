//! OpenCV's `FileStorage`: a camera matrix and distortion coefficients under names that every
//! program chooses for itself.
//!
//! With `xi` it is `cv::omnidir` (`k1, k2, p1, p2`), else `cv::fisheye` (`k1` to `k4`) where the
//! file says so, or has four coefficients and says nothing. Five and more are an ordinary camera.
//!
//! Files of several cameras number the names (`K1`, `camera_matrix_2`), call them left and right,
//! or have a camera in each of their fields.

use lookdown_lens::geometry::lens::{LensModel, Mei};
use serde_json::{Map, Value};

use super::{
    Camera, FileCamera, FormatError,
    camera_file::{alone, named},
    camera_matrix::{CameraMatrix, Distortion, not_a_fisheye},
    fields::Fields,
};
use crate::{
    native::NativeImage,
    warning::{Warning, WarningCode},
};

/// Names of the camera matrix that programs choose.
const MATRIX: &str = "camera_matrix cameraMatrix Camera_Matrix CameraMatrix CameraMat K M mtx \
                      intrinsic_matrix intrinsics matrix";
/// Names of the distortion coefficients.
const COEFFICIENTS: &str = "distortion_coefficients distCoeffs DistCoeffs DistCoeff \
                            Distortion_Coefficients D dist dist_coeffs dist_coeff distortion \
                            distortions";
/// Names of the frame's width and height.
const SIZES: [(&str, &str); 4] = [
    ("image_width", "image_height"),
    ("image_Width", "image_Height"),
    ("imageWidth", "imageHeight"),
    ("width", "height"),
];
/// Names of the frame size as one field.
const SIZE_PAIRS: &str = "image_size imageSize ImageSize img_size imgSize resolution size \
                          cameraResolution DIM dim Dim";
/// Fields of other programs, which have a camera matrix as well.
const OTHERS: [&str; 2] = ["RadialDistortion", "sfm_data_version"];
/// Names of the distortion model.
const MODELS: &str = "distortion_model camera_model model DistModel";
/// Fields that calibration programs store before they have a result.
const CORNERS: [&str; 2] = ["imagePoints", "image_points"];

/// Returns true for a file with any of the names by which OpenCV's files are known.
pub(super) fn is_storage(fields: &Fields<'_>) -> bool {
    let mut entries = fields.map.values().filter_map(Value::as_object);
    if OTHERS.iter().any(|name| fields.has(name)) {
        return false;
    }
    has_matrix(fields.map)
        || CORNERS.iter().any(|name| fields.has(name))
        || !sides(fields).is_empty()
        || entries.any(has_matrix)
}

fn has_matrix(map: &Map<String, Value>) -> bool {
    MATRIX.split(' ').any(|name| map.contains_key(name))
}

/// Names of the cameras in a file of several: what stands before or behind the name of a matrix,
/// as a number or a side.
fn sides<'a>(fields: &Fields<'a>) -> Vec<&'a str> {
    let mut sides = Vec::new();
    for key in fields.map.keys() {
        // A number under such a name is a coefficient.
        if !fields.numbers(key).is_ok_and(|numbers| numbers.len() == 9) {
            continue;
        }
        let parts = |name: &str| key.strip_prefix(name).or(key.strip_suffix(name));
        for part in MATRIX.split(' ').filter_map(parts) {
            let side = part.trim_matches(['_', '.']);
            let is_number = !side.is_empty() && side.bytes().all(|byte| byte.is_ascii_digit());
            let is_side = ["l", "r", "left", "right"].contains(&&*side.to_ascii_lowercase());
            if (is_number || is_side) && !sides.contains(&side) {
                sides.push(side);
            }
        }
    }
    sides
}

pub(super) fn read(fields: &Fields<'_>) -> Vec<FileCamera> {
    let is_camera = |entry: &Value| entry.as_object().is_some_and(has_matrix);
    if has_matrix(fields.map) {
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
    let Some(matrix) = present(fields, MATRIX, side) else {
        return Err(fields.invalid(
            "camera_matrix",
            "it is missing: the file holds the corner points of a calibration, not its result",
        ));
    };
    let matrix = CameraMatrix::read(fields, matrix)?;
    let coefficients = present(fields, COEFFICIENTS, side).unwrap_or("distortion_coefficients");
    let (lens, note) = if let Some(xi) = present(fields, "xi Xi", side) {
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
    if let Some(key) = present(fields, MODELS, "") {
        let name = fields.text(key)?;
        let problem = || format!("it is {name:?}: fisheye or equidistant is read");
        let known = Distortion::from_name(name).ok_or_else(|| fields.invalid(key, problem()))?;
        return Ok((key, Some(known)));
    }
    let flag = if fields.has("fisheye") {
        "fisheye"
    } else {
        "fisheye_model"
    };
    let distortion = match fields.map.get(flag) {
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
            let keys = present(fields, width, side).zip(present(fields, height, side));
            if let Some((width, height)) = keys {
                return fields.image(width, height).map(Some);
            }
        }
        if let Some(key) = present(fields, SIZE_PAIRS, side) {
            return fields.image_pair(key).map(Some);
        }
    }
    Ok(None)
}

/// The first of the names, between spaces, that the file has: as it is, or joined with that of a
/// camera.
fn present<'a>(fields: &Fields<'a>, names: &str, side: &str) -> Option<&'a str> {
    names.split(' ').find_map(|name| {
        let joined = ["", "_", "."].map(|joint| {
            [
                format!("{name}{joint}{side}"),
                format!("{side}{joint}{name}"),
            ]
        });
        let key = joined.iter().flatten().find(|key| fields.has(key))?;
        Some(fields.map.get_key_value(key)?.0.as_str())
    })
}
