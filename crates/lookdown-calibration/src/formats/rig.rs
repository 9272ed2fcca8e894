//! Lists of cameras of visual-inertial SLAM: `OKVIS` (`distortion_type`, `focal_length`), and the
//! `ncamera` of maplab, `SVO` and other programs of the ASL (`camera`, with `distortion`).
//!
//! There `equidistant` is `cv::fisheye`, and `fisheye` is the model of one angle, `FOV`.

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
    let first = fields.map.get(LIST).and_then(|list| list.get(0));
    let has = |key: &str| first.is_some_and(|entry| entry.get(key).is_some());
    has("distortion_type") || has("camera")
}

pub(super) fn read(fields: &Fields<'_>) -> Vec<FileCamera> {
    let cameras = fields.entries(LIST).enumerate();
    let cameras = cameras.map(|(index, camera)| FileCamera {
        name: Some(index.to_string()),
        camera: camera.and_then(|camera| read_camera(&camera)),
    });
    cameras.collect()
}

fn read_camera(entry: &Fields<'_>) -> Result<Camera, FormatError> {
    if !entry.has("camera") {
        let [fx, fy] = entry.exactly("focal_length", "fx, fy")?;
        let [cx, cy] = entry.exactly("principal_point", "cx, cy")?;
        let values = entry.numbers("distortion_coefficients")?;
        let lens = lens(entry, "distortion_type", [fx, fy, cx, cy], &values)?;
        let image = entry.image_pair("image_dimension")?;
        return Ok(Camera::new(Some(image), lens));
    }
    let camera = entry.child("camera")?;
    if camera.text("type").ok() != Some("pinhole") {
        return Err(camera.invalid("type", "only pinhole with a distortion is read"));
    }
    let pinhole = camera.exactly("intrinsics", "fu, fv, cu, cv")?;
    let distortion = camera.child("distortion")?;
    let values = distortion.numbers("parameters")?;
    let lens = lens(&distortion, "type", pinhole, &values)?;
    let image = camera.image("image_width", "image_height")?;
    Ok(Camera::new(Some(image), lens))
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
