//! MOIL's `camera_parameters.json`: one camera, or several by name; the radius in pixels is
//! `calibrationRatio · (parameter0·a⁶ + parameter1·a⁵ + … + parameter5·a)`
//! (<https://github.com/MoilOrg/moildev>).

use serde_json::Value;

use super::{Camera, FileCamera, FormatError, camera_file::named, claimed_field, fields::Fields};
use lookdown_lens::geometry::lens::RadialPolynomial;

pub(super) fn read(fields: &Fields<'_>) -> Vec<FileCamera> {
    if fields.has("calibrationRatio") {
        return super::alone(read_camera(fields));
    }
    let is_camera = |entry: &Value| entry.get("calibrationRatio").is_some_and(Value::is_number);
    named(fields, is_camera, read_camera)
}

fn read_camera(camera: &Fields<'_>) -> Result<Camera, FormatError> {
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
    Ok(claimed_field::camera(
        image,
        field_of_view / 2.0,
        |max_theta| {
            RadialPolynomial {
                max_theta: Some(max_theta),
                ..RadialPolynomial::new(coefficients.clone(), [cx, cy])
            }
            .into()
        },
    ))
}
