//! Kalibr's camchain: `cam0`, `cam1` …, each a `camera_model` with a `distortion_model`
//! (<https://github.com/ethz-asl/kalibr/wiki/supported-models>).
//!
//! The parameters of the sphere models come before the focal lengths: `omni` is `xi fu fv pu pv`,
//! `ds` is `xi alpha fu fv pu pv`, `eucm` is `alpha beta fu fv pu pv`.

use lookdown_lens::geometry::lens::{
    DoubleSphere, Eucm, Fov, KannalaBrandt, LensModel, Mei, Rectilinear,
};
use serde_json::Value;

use super::{
    Camera, FileCamera, FormatError,
    camera_file::{alone, named},
    camera_matrix::{Distortion, are_all_zero, four, not_a_fisheye},
    fields::Fields,
};

pub(super) fn read(fields: &Fields<'_>) -> Vec<FileCamera> {
    if fields.has("camera_model") {
        return alone(read_camera(fields));
    }
    let is_camera = |entry: &Value| entry.get("camera_model").is_some();
    named(fields, is_camera, read_camera)
}

fn read_camera(camera: &Fields<'_>) -> Result<Camera, FormatError> {
    let lens = lens(camera)?;
    let image = camera.image_pair("resolution")?;
    Ok(Camera::new(Some(image), lens))
}

fn lens(camera: &Fields<'_>) -> Result<LensModel, FormatError> {
    let model = camera.text("camera_model")?;
    let (distortion, coefficients) = distortion(camera)?;
    let intrinsics = "intrinsics";
    match (model, distortion) {
        ("pinhole", _) => {
            let pinhole = camera.exactly(intrinsics, "fu, fv, pu, pv")?;
            match distortion {
                Distortion::None => Ok(Rectilinear::new(pinhole).into()),
                Distortion::Fisheye => {
                    let k = four(&coefficients)
                        .map_err(|problem| camera.invalid(COEFFICIENTS, problem))?;
                    Ok(KannalaBrandt::new(pinhole, k).into())
                }
                Distortion::Fov => {
                    let [omega] = camera.exactly(COEFFICIENTS, "w")?;
                    Ok(Fov::new(pinhole, omega).into())
                }
                Distortion::RadialTangential => {
                    Err(camera.invalid(MODEL, not_a_fisheye("radtan on a pinhole camera")))
                }
            }
        }
        ("omni", Distortion::None | Distortion::RadialTangential) => {
            let [xi, fu, fv, pu, pv] = camera.exactly(intrinsics, "xi, fu, fv, pu, pv")?;
            let [k1, k2, p1, p2] = if distortion == Distortion::None {
                [0.0; 4]
            } else {
                camera.exactly(COEFFICIENTS, "k1, k2, p1, p2")?
            };
            Ok(Mei::new([fu, fv, pu, pv], xi, k1, k2, p1, p2).into())
        }
        ("ds", Distortion::None) => {
            let [xi, alpha, fu, fv, pu, pv] =
                camera.exactly(intrinsics, "xi, alpha, fu, fv, pu, pv")?;
            Ok(DoubleSphere::new([fu, fv, pu, pv], xi, alpha).into())
        }
        ("eucm", Distortion::None) => {
            let [alpha, beta, fu, fv, pu, pv] =
                camera.exactly(intrinsics, "alpha, beta, fu, fv, pu, pv")?;
            Ok(Eucm::new([fu, fv, pu, pv], alpha, beta).into())
        }
        ("omni" | "ds" | "eucm", _) => Err(camera.invalid(
            MODEL,
            format!(
                "it is {:?} on a camera_model of {model:?}: calibrate with omni-radtan, omni-none, \
                 ds-none or eucm-none",
                camera.text(MODEL)?
            ),
        )),
        _ => Err(camera.invalid(
            "camera_model",
            format!("it is {model:?}: pinhole, omni, ds and eucm are read"),
        )),
    }
}

const MODEL: &str = "distortion_model";
const COEFFICIENTS: &str = "distortion_coeffs";
/// The name in the `sensor.yaml` of data sets in the form of `EuRoC`, which has one camera.
const SENSOR_COEFFICIENTS: &str = "distortion_coefficients";

/// The distortion with its coefficients; one whose coefficients are all 0 is none.
fn distortion(camera: &Fields<'_>) -> Result<(Distortion, Vec<f64>), FormatError> {
    if !camera.has(MODEL) {
        return Ok((Distortion::None, Vec::new()));
    }
    let name = camera.text(MODEL)?;
    let problem = || format!("it is {name:?}: equidistant, radtan, fov and none are read");
    let distortion = Distortion::from_name(name);
    let distortion = distortion.ok_or_else(|| camera.invalid(MODEL, problem()))?;
    if distortion == Distortion::None {
        return Ok((distortion, Vec::new()));
    }
    let key = if camera.has(SENSOR_COEFFICIENTS) {
        SENSOR_COEFFICIENTS
    } else {
        COEFFICIENTS
    };
    let coefficients = camera.numbers(key)?;
    if distortion == Distortion::RadialTangential && are_all_zero(&coefficients) {
        return Ok((Distortion::None, Vec::new()));
    }
    Ok((distortion, coefficients))
}
