//! Settings of visual SLAM: `OpenVSLAM` and `stella_vslam` (`Camera.model: fisheye`, or the fields
//! below `Camera`), ORB-SLAM2 and 3 (`Camera.type: KannalaBrandt8` with `Camera.fx`, or
//! `Camera1.fx` and `Camera2.fx` of two cameras), and the lists of cameras of visual-inertial SLAM.
//!
//! `k1` to `k4` are those of `cv::fisheye`.

use lookdown_lens::geometry::lens::{Fov, KannalaBrandt, LensModel, Rectilinear};
use serde_json::{Map, Value};

use super::{
    Camera, FileCamera, FormatError,
    camera_matrix::{Distortion, are_all_zero, four, not_a_fisheye},
    fields::Fields,
    named_parameters::{NamedModel, pinhole, read_model},
};

/// The parameters of the only or the left camera, or of the right one.
const CAMERAS: [&str; 3] = ["Camera1", "Camera", "Camera2"];

/// Returns true for the settings of a SLAM program.
pub(super) fn is_settings(fields: &Fields<'_>) -> bool {
    let is_camera = |name: &str| {
        let group = group(fields, name);
        group.contains_key("fx") || (group.contains_key("model") && group.contains_key("cols"))
    };
    CAMERAS.into_iter().any(is_camera) || is_rig(fields)
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
    if is_rig(fields) {
        return read_rig(fields);
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
        let lens = read_model(NamedModel::KannalaBrandt, parameters)?;
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
    let lens = Rectilinear::new(pinhole(parameters)?);
    Ok(Camera::new(image, lens))
}

/// The list of cameras of visual-inertial SLAM: `OKVIS` (`distortion_type`, `focal_length`), and
/// the `ncamera` of maplab, `SVO` and other programs of the ASL (`camera`, with `distortion`).
///
/// There `equidistant` is `cv::fisheye`, and `fisheye` is the model of one angle, `FOV`.
const LIST: &str = "cameras";

/// Returns true for a list whose entries have a distortion of their own.
fn is_rig(fields: &Fields<'_>) -> bool {
    let first = fields.map.get(LIST).and_then(|list| list.get(0));
    let has = |key: &str| first.is_some_and(|entry| entry.get(key).is_some());
    has("distortion_type") || has("camera")
}

fn read_rig(fields: &Fields<'_>) -> Vec<FileCamera> {
    let cameras = fields.entries(LIST).enumerate();
    let cameras = cameras.map(|(index, camera)| FileCamera {
        name: Some(index.to_string()),
        camera: camera.and_then(|camera| read_rig_camera(&camera)),
    });
    cameras.collect()
}

fn read_rig_camera(entry: &Fields<'_>) -> Result<Camera, FormatError> {
    if !entry.has("camera") {
        let [fx, fy] = entry.exactly("focal_length", "fx, fy")?;
        let [cx, cy] = entry.exactly("principal_point", "cx, cy")?;
        let values = entry.numbers("distortion_coefficients")?;
        let lens = rig_lens(entry, "distortion_type", [fx, fy, cx, cy], &values)?;
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
    let lens = rig_lens(&distortion, "type", pinhole, &values)?;
    let image = camera.image("image_width", "image_height")?;
    Ok(Camera::new(Some(image), lens))
}

fn rig_lens(
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
