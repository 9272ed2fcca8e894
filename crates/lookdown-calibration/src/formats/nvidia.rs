//! NVIDIA's f-theta camera as `ncore` stores it (<https://github.com/NVIDIA/ncore>,
//! `docs/data/sensor_models.rst`).
//!
//! Only the polynomial named by `reference_poly` is exact, not the other one. The principal point
//! speaks of pixel centers, unlike that of ncore's other cameras.

use serde_json::Value;

use super::{Camera, FormatError, claimed_field, fields::Fields};
use lookdown_lens::geometry::lens::FTheta;

pub(super) fn read(fields: &Fields<'_>) -> Result<Camera, FormatError> {
    let model = fields.text("camera_model_type")?;
    if model != "ftheta" {
        let problem = format!("it is {model:?}: ftheta is read");
        return Err(fields.invalid("camera_model_type", problem));
    }
    let parameters = fields.child("camera_model_parameters")?;
    if let Some(windshield) = parameters.map.get("external_distortion_parameters")
        && *windshield != Value::Null
    {
        return Err(parameters.invalid(
            "external_distortion_parameters",
            "a windshield before the lens is not read: give the lens alone",
        ));
    }
    let read = |key| polynomial(&parameters, key).map(Some);
    let (forward, backward) = match parameters.text("reference_poly")? {
        "ANGLE_TO_PIXELDIST" => (read("angle_to_pixeldist_poly")?, None),
        "PIXELDIST_TO_ANGLE" => (None, read("pixeldist_to_angle_poly")?),
        other => {
            return Err(parameters.invalid(
                "reference_poly",
                format!("it is {other:?}: give ANGLE_TO_PIXELDIST or PIXELDIST_TO_ANGLE"),
            ));
        }
    };
    let [c, d, e] = affine(&parameters)?;
    let [cx, cy] = parameters.exactly("principal_point", "u and v")?;
    let image = parameters.image_pair("resolution")?;
    let max_angle = parameters.number("max_angle")?;
    Ok(claimed_field::camera(image, max_angle, |max_theta| {
        FTheta {
            angle_to_pixel: forward,
            pixel_to_angle: backward,
            c,
            d,
            e,
            cx,
            cy,
            max_theta: Some(max_theta),
        }
        .into()
    }))
}

/// Six coefficients, the missing ones of a shorter polynomial 0.
fn polynomial(parameters: &Fields<'_>, key: &str) -> Result<[f64; 6], FormatError> {
    let coefficients = parameters.numbers(key)?;
    if !(2..=6).contains(&coefficients.len()) {
        let problem = format!("it has {} numbers: 2 to 6 are needed", coefficients.len());
        return Err(parameters.invalid(key, problem));
    }
    let mut six = [0.0; 6];
    six[..coefficients.len()].copy_from_slice(&coefficients);
    Ok(six)
}

/// The linear term; three zeros stand for none, as in `DriveWorks`.
fn affine(parameters: &Fields<'_>) -> Result<[f64; 3], FormatError> {
    if !parameters.has("linear_cde") {
        return Ok([1.0, 0.0, 0.0]);
    }
    let affine = parameters.exactly("linear_cde", "c, d and e")?;
    Ok(if affine == [0.0; 3] {
        [1.0, 0.0, 0.0]
    } else {
        affine
    })
}
