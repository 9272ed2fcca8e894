//! Formats in which the radius is a polynomial of the angle, or the angle one of the radius.

use lookdown_lens::geometry::{
    Lens, LensError,
    lens::{FTheta, LensModel, RadialPolynomial},
};
use serde_json::Value;

use super::{
    Camera, FileCamera, FormatError,
    camera_file::{alone, named},
    fields::Fields,
};
use crate::{
    native::NativeImage,
    warning::{Warning, WarningCode},
};

/// `WoodScape`: `intrinsic` with the radius in pixels as a polynomial of the angle
/// (<https://github.com/valeoai/WoodScape>, `scripts/calibration`).
///
/// The principal point is an offset from the center of the image, which lies half a pixel before
/// `width / 2` because pixel centers are whole numbers.
pub(super) fn read_woodscape(fields: &Fields<'_>) -> Result<Camera, FormatError> {
    let intrinsic = fields.child("intrinsic")?;
    if intrinsic.has("model") && intrinsic.text("model")? != "radial_poly" {
        let problem = format!("it is {:?}: radial_poly is read", intrinsic.text("model")?);
        return Err(intrinsic.invalid("model", problem));
    }
    let image = intrinsic.image("width", "height")?;
    let center = |side: u32| f64::from(side) / 2.0 - 0.5;
    let [k1, k2, k3, k4] = intrinsic.each(["k1", "k2", "k3", "k4"])?;
    let aspect = intrinsic.number_or("aspect_ratio", 1.0)?;
    let cx = intrinsic.number("cx_offset")? + center(image.width);
    let cy = intrinsic.number("cy_offset")? + center(image.height);
    let lens = RadialPolynomial {
        aspect,
        ..RadialPolynomial::new(vec![0.0, k1, k2, k3, k4], [cx, cy])
    };
    Ok(Camera::new(Some(image), lens))
}

/// A camera whose lens image is said to end at `max_theta` (radians); where the curve turns over
/// before that, it ends there, and a note says so.
fn claimed_field(image: NativeImage, max_theta: f64, lens: impl Fn(f64) -> LensModel) -> Camera {
    let claimed = lens(max_theta);
    if let Err(LensError {
        limit: Some(limit), ..
    }) = Lens::new(&claimed)
        && max_theta > limit
    {
        let mut camera = Camera::new(Some(image), lens(limit));
        let message = format!(
            "the file claims a field of view of {:.1}°, but its curve turns over at {:.1}°: the \
             lens image ends there",
            2.0 * max_theta.to_degrees(),
            2.0 * limit.to_degrees()
        );
        let note = Warning::new(WarningCode::FieldOfViewReduced, message);
        camera.notes.push(note);
        return camera;
    }
    Camera::new(Some(image), claimed)
}

/// MOIL's `camera_parameters.json`: one camera, or several by name; the radius in pixels is
/// `calibrationRatio · (parameter0·a⁶ + parameter1·a⁵ + … + parameter5·a)`
/// (<https://github.com/MoilOrg/moildev>).
pub(super) fn read_moil(fields: &Fields<'_>) -> Vec<FileCamera> {
    if fields.has("calibrationRatio") {
        return alone(read_moil_camera(fields));
    }
    let is_camera = |entry: &Value| entry.get("calibrationRatio").is_some_and(Value::is_number);
    named(fields, is_camera, read_moil_camera)
}

fn read_moil_camera(camera: &Fields<'_>) -> Result<Camera, FormatError> {
    let ratio = camera.number_or("ratio", 1.0)?;
    if ratio != 1.0 {
        let problem =
            format!("it is {ratio}: only square pixels (1) are read, measure this lens anew");
        return Err(camera.invalid("ratio", problem));
    }
    let scale = camera.number("calibrationRatio")?;
    let mut coefficients = vec![0.0];
    for power in (0..6).rev() {
        coefficients.push(scale * camera.number(&format!("parameter{power}"))?);
    }
    // The file writes a shorter polynomial as a long one with zeros.
    while coefficients.len() > 2 && coefficients.last() == Some(&0.0) {
        coefficients.pop();
    }
    let (cx, cy) = (camera.number("iCx")?, camera.number("iCy")?);
    let image = camera.image("imageWidth", "imageHeight")?;
    let field_of_view = camera.number("cameraFov")?.to_radians();
    Ok(claimed_field(image, field_of_view / 2.0, |max_theta| {
        RadialPolynomial {
            max_theta: Some(max_theta),
            ..RadialPolynomial::new(coefficients.clone(), [cx, cy])
        }
        .into()
    }))
}

/// NVIDIA's f-theta camera as `ncore` stores it (<https://github.com/NVIDIA/ncore>,
/// `docs/data/sensor_models.rst`).
///
/// Only the polynomial named by `reference_poly` is exact, not the other one. The principal point
/// speaks of pixel centers, unlike that of ncore's other cameras.
pub(super) fn read_nvidia(fields: &Fields<'_>) -> Result<Camera, FormatError> {
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
    Ok(claimed_field(image, max_angle, |max_theta| {
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
