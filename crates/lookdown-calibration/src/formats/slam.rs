//! Settings of visual SLAM: `OpenVSLAM` and `stella_vslam` (`Camera.model: fisheye`, or the fields
//! below `Camera`), ORB-SLAM2 and 3 (`Camera.type: KannalaBrandt8` with `Camera.fx`, or
//! `Camera1.fx` and `Camera2.fx` of two cameras), and the lists of cameras in `rig.rs`.
//!
//! `k1` to `k4` are those of `cv::fisheye`.

use serde_json::{Map, Value};

use super::{
    Camera, FileCamera, FormatError,
    distortion::{Distortion, are_all_zero, not_a_fisheye},
    fields::Fields,
    named_parameters::{self, NamedModel},
    rig,
};
use lookdown_lens::geometry::lens::Rectilinear;

/// The parameters of the only or the left camera, or of the right one.
const CAMERAS: [&str; 3] = ["Camera1", "Camera", "Camera2"];

/// Returns true for the settings of a SLAM program.
pub(super) fn is_settings(fields: &Fields<'_>) -> bool {
    let is_camera = |name: &str| {
        let group = group(fields, name);
        group.contains_key("fx") || (group.contains_key("model") && group.contains_key("cols"))
    };
    CAMERAS.into_iter().any(is_camera) || rig::is_rig(fields)
}

/// The fields below a name, or those whose names begin with it and a dot.
fn group(fields: &Fields<'_>, name: &str) -> Map<String, Value> {
    if let Some(Value::Object(nested)) = fields.map.get(name) {
        return nested.clone();
    }
    let below = |(key, value): (&String, &Value)| {
        let key = key.strip_prefix(name)?.strip_prefix('.')?;
        Some((key.to_owned(), value.clone()))
    };
    fields.map.iter().filter_map(below).collect()
}

pub(super) fn read(fields: &Fields<'_>) -> Vec<FileCamera> {
    if rig::is_rig(fields) {
        return rig::read(fields);
    }
    let common = group(fields, "Camera");
    let mut cameras = Vec::new();
    for name in CAMERAS {
        let parameters = group(fields, name);
        // A panorama of the whole sphere has no focal length.
        if parameters.contains_key("fx") || parameters.contains_key("model") {
            let parameters = fields.inside(name, &parameters);
            cameras.push(FileCamera {
                name: Some(name.to_owned()),
                camera: read_camera(&fields.inside("Camera", &common), &parameters),
            });
        }
    }
    cameras
}

fn read_camera(common: &Fields<'_>, parameters: &Fields<'_>) -> Result<Camera, FormatError> {
    let sides = [("cols", "rows"), ("width", "height")];
    let sides = sides.into_iter().find(|(width, _)| common.has(width));
    let image = sides.map(|(width, height)| common.image(width, height));
    let image = image.transpose()?;
    let key = if common.has("model") { "model" } else { "type" };
    let model = if common.has(key) {
        common.text(key)?
    } else {
        "PinHole"
    };
    if Distortion::from_name(model) == Some(Distortion::Fisheye) {
        let lens = named_parameters::read(NamedModel::KannalaBrandt, parameters)?;
        return Ok(Camera::new(image, lens));
    }
    let distortion = parameters.optional(["k1", "k2", "p1", "p2", "k3"])?;
    let is_plain = ["PinHole", "Rectified", "perspective"].contains(&model);
    if !(is_plain || Distortion::from_name(model).is_some()) {
        let problem = format!("it is {model:?}: fisheye and KannalaBrandt8 are read");
        return Err(common.invalid(key, problem));
    }
    if !(is_plain && are_all_zero(&distortion)) {
        return Err(common.invalid(key, not_a_fisheye(model)));
    }
    let lens = Rectilinear::new(named_parameters::pinhole(parameters)?);
    Ok(Camera::new(image, lens))
}
