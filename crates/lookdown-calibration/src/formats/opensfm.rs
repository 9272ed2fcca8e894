//! `camera_models.json` of `OpenSfM`, and `cameras.json` of ODM: cameras by name, each with a
//! `projection_type` (<https://opensfm.org/docs/geometry.html>).
//!
//! Lengths are shares of the longer side, from the middle of the frame. `fisheye` has `k1, k2`,
//! `fisheye_opencv` `k1` to `k4`, `fisheye62` and `fisheye624` have `k1` to `k6` with terms that no
//! lens here has, so they are read only where these are 0.

use lookdown_lens::geometry::lens::{KannalaBrandt, LensModel, RadialPolynomial, Rectilinear};
use serde_json::Value;

use super::{
    Camera, FileCamera, FormatError,
    camera_file::named,
    camera_matrix::{are_all_zero, not_a_fisheye},
    fields::Fields,
};

pub(super) fn read(fields: &Fields<'_>) -> Vec<FileCamera> {
    let is_camera = |entry: &Value| entry.get("projection_type").is_some();
    named(fields, is_camera, read_camera)
}

fn read_camera(camera: &Fields<'_>) -> Result<Camera, FormatError> {
    let image = camera.image("width", "height")?;
    let side = f64::from(image.width.max(image.height));
    let focal = |key| camera.number(if camera.has(key) { key } else { "focal" });
    let [c_x, c_y] = camera.optional(["c_x", "c_y"])?;
    let pinhole = [
        focal("focal_x")? * side,
        focal("focal_y")? * side,
        c_x * side + (f64::from(image.width) - 1.0) / 2.0,
        c_y * side + (f64::from(image.height) - 1.0) / 2.0,
    ];
    let k = camera.optional(["k1", "k2", "k3", "k4", "k5", "k6"])?;
    let others = ["p1", "p2", "s0", "s1", "s2", "s3"];
    let type_field = "projection_type";
    let model = camera.text(type_field)?;
    if model.starts_with("fisheye") && !are_all_zero(&camera.optional(others)?) {
        let problem = format!(
            "it is {model:?} with tangential or thin-prism terms that are not \
             0, which have no lens here: reconstruct with fisheye_opencv"
        );
        return Err(camera.invalid(type_field, problem));
    }
    let lens: LensModel = match (model, k) {
        ("fisheye" | "fisheye_opencv" | "fisheye62" | "fisheye624", [k1, k2, k3, k4, 0.0, 0.0]) => {
            KannalaBrandt::new(pinhole, [k1, k2, k3, k4]).into()
        }
        ("fisheye62" | "fisheye624", k) => {
            let [fx, fy, cx, cy] = pinhole;
            let odd_powers = k.into_iter().flat_map(|k| [0.0, k * fx]);
            let coefficients = [0.0, fx].into_iter().chain(odd_powers).collect();
            let aspect = fy / fx;
            RadialPolynomial {
                aspect,
                ..RadialPolynomial::new(coefficients, [cx, cy])
            }
            .into()
        }
        ("perspective" | "simple_radial" | "radial" | "brown", k)
            if are_all_zero(&k) && are_all_zero(&camera.optional(others)?) =>
        {
            Rectilinear::new(pinhole).into()
        }
        ("perspective" | "simple_radial" | "radial" | "brown", _) => {
            return Err(camera.invalid(type_field, not_a_fisheye(model)));
        }
        _ => {
            let problem = format!(
                "it is {model:?}: fisheye, fisheye_opencv, fisheye62 and \
                 fisheye624 are read"
            );
            return Err(camera.invalid(type_field, problem));
        }
    };
    Ok(Camera::new(Some(image), lens))
}
