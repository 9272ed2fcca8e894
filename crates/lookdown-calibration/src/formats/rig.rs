//! Lists of cameras of visual-inertial SLAM: `OKVIS` (`distortion_type`, `focal_length`), and the
//! `ncamera` of maplab, `SVO` and other programs of the ASL (`camera`, with `distortion`).
//!
//! There `equidistant` is `cv::fisheye`, and `fisheye` is the model of one angle, `FOV`.

use serde_json::Value;

use super::{
    Camera, FileCamera, FormatError,
    distortion::{are_all_zero, four, not_a_fisheye},
    fields::Fields,
};
use lookdown_lens::geometry::lens::{Fov, KannalaBrandt, LensModel, Rectilinear};

/// The list of cameras.
const LIST: &str = "cameras";

/// Returns true for a list whose entries have a distortion of their own.
pub(super) fn is_rig(fields: &Fields<'_>) -> bool {
    let first = fields.map().get(LIST).and_then(|list| list.get(0));
    let has = |key: &str| first.is_some_and(|entry| entry.get(key).is_some());
    has("distortion_type") || has("camera")
}

pub(super) fn read(fields: &Fields<'_>) -> Vec<FileCamera> {
    let count = fields.map()[LIST].as_array().map_or(0, Vec::len);
    let entry = |index| FileCamera {
        name: Some(format!("{index}")),
        camera: fields
            .entry(LIST, index)
            .and_then(|entry| read_camera(&entry)),
    };
    (0..count).map(entry).collect()
}

fn read_camera(entry: &Fields<'_>) -> Result<Camera, FormatError> {
    if !entry.has("camera") {
        let [fx, fy] = entry.exactly("focal_length", "fx, fy")?;
        let [cx, cy] = entry.exactly("principal_point", "cx, cy")?;
        let values = entry.numbers("distortion_coefficients")?;
        let lens = lens(entry, "distortion_type", [fx, fy, cx, cy], &values)?;
        return Ok(Camera::new(
            Some(entry.image_pair("image_dimension")?),
            lens,
        ));
    }
    let camera = entry.child("camera")?;
    if camera.map().get("type").and_then(Value::as_str) != Some("pinhole") {
        return Err(camera.invalid("type", "only pinhole with a distortion is read"));
    }
    let pinhole = camera.exactly("intrinsics", "fu, fv, cu, cv")?;
    let distortion = camera.child("distortion")?;
    let values = distortion.numbers("parameters")?;
    let lens = lens(&distortion, "type", pinhole, &values)?;
    Ok(Camera::new(
        Some(camera.image("image_width", "image_height")?),
        lens,
    ))
}

fn lens(
    fields: &Fields<'_>,
    key: &str,
    pinhole: [f64; 4],
    values: &[f64],
) -> Result<LensModel, FormatError> {
    let name = fields.text(key)?;
    Ok(match (name, values) {
        ("equidistant", _) => {
            let k = four(values).map_err(|problem| fields.invalid(key, problem))?;
            KannalaBrandt::new(pinhole, k).into()
        }
        ("fisheye", &[omega]) => Fov::new(pinhole, omega).into(),
        _ if are_all_zero(values) => Rectilinear::new(pinhole).into(),
        _ => return Err(fields.invalid(key, not_a_fisheye(name))),
    })
}
