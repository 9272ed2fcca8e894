//! Formats whose parameters are named the same way by several programs: `fx fy cx cy` and then the
//! letters of the model's own paper.

use lookdown_lens::geometry::lens::{
    DoubleSphere, Eucm, Fov, KannalaBrandt, LensModel, Pinhole, Rectilinear, Ucm,
};
use serde_json::Value;

use super::{
    Camera, FileCamera, FormatError,
    camera_matrix::not_a_fisheye,
    fields::{Fields, whole_pixels},
    ocam::{ColumnFirst, negated},
};
use crate::native::NativeImage;

/// A model whose parameters have the same names everywhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NamedModel {
    DoubleSphere,
    Eucm,
    Ucm,
    KannalaBrandt,
}

/// Reads the parameters of a model.
pub(super) fn read_model(model: NamedModel, fields: &Fields<'_>) -> Result<LensModel, FormatError> {
    let pinhole = pinhole(fields)?;
    Ok(match model {
        NamedModel::DoubleSphere => {
            DoubleSphere::new(pinhole, fields.number("xi")?, fields.number("alpha")?).into()
        }
        NamedModel::Eucm => {
            Eucm::new(pinhole, fields.number("alpha")?, fields.number("beta")?).into()
        }
        NamedModel::Ucm => Ucm::new(pinhole, fields.number("alpha")?).into(),
        NamedModel::KannalaBrandt => {
            let k = fields.each(["k1", "k2", "k3", "k4"])?;
            KannalaBrandt::new(pinhole, k).into()
        }
    })
}

/// `fx fy cx cy`.
pub(super) fn pinhole(fields: &Fields<'_>) -> Result<Pinhole, FormatError> {
    fields.each(["fx", "fy", "cx", "cy"])
}

/// Basalt: `value0.intrinsics[]` with a `camera_type` each and `value0.resolution[]`
/// (<https://gitlab.com/VladyslavUsenko/basalt-headers>, `calibration.hpp`).
pub(super) fn read_basalt(fields: &Fields<'_>) -> Result<Vec<FileCamera>, FormatError> {
    let calibration = fields.child("value0")?;
    calibration.get("intrinsics")?;
    let cameras = calibration.entries("intrinsics").enumerate();
    let cameras = cameras.map(|(index, camera)| FileCamera {
        name: Some(format!("cam{index}")),
        camera: camera.and_then(|camera| read_basalt_camera(&calibration, index, &camera)),
    });
    Ok(cameras.collect())
}

fn read_basalt_camera(
    calibration: &Fields<'_>,
    index: usize,
    camera: &Fields<'_>,
) -> Result<Camera, FormatError> {
    let parameters = camera.child("intrinsics")?;
    let model = match camera.text("camera_type")? {
        "ds" => NamedModel::DoubleSphere,
        "eucm" => NamedModel::Eucm,
        "ucm" => NamedModel::Ucm,
        "kb4" => NamedModel::KannalaBrandt,
        "pinhole" => {
            let lens = Rectilinear::new(pinhole(&parameters)?);
            return Ok(Camera::new(Some(basalt_image(calibration, index)?), lens));
        }
        other @ "pinhole-radtan8" => {
            return Err(camera.invalid("camera_type", not_a_fisheye(other)));
        }
        other => {
            let problem = format!("it is {other:?}: ds, eucm, ucm, kb4 and pinhole are read");
            return Err(camera.invalid("camera_type", problem));
        }
    };
    let lens = read_model(model, &parameters)?;
    Ok(Camera::new(Some(basalt_image(calibration, index)?), lens))
}

fn basalt_image(calibration: &Fields<'_>, index: usize) -> Result<NativeImage, FormatError> {
    let resolution = calibration.get("resolution")?.get(index);
    let sides: Vec<_> = resolution
        .and_then(Value::as_array)
        .into_iter()
        .flatten()
        .filter_map(Value::as_f64)
        .filter_map(whole_pixels)
        .collect();
    match sides[..] {
        [width, height] => Ok(NativeImage { width, height }),
        _ => Err(calibration.invalid(
            &format!("resolution[{index}]"),
            "width and height in whole pixels are needed",
        )),
    }
}

/// The Rust crate `camera-intrinsic-model`: one map, named after the model
/// (<https://github.com/powei-lin/camera-intrinsic-model-rs>).
pub(super) fn read_camera_intrinsic_model(fields: &Fields<'_>) -> Result<Camera, FormatError> {
    let model = fields.map.keys().next().map_or("", String::as_str);
    let parameters = fields.child(model)?;
    let lens = match model {
        "EUCM" => read_model(NamedModel::Eucm, &parameters)?,
        "UCM" => read_model(NamedModel::Ucm, &parameters)?,
        "KannalaBrandt4" => read_model(NamedModel::KannalaBrandt, &parameters)?,
        "FovCamera" => Fov::new(pinhole(&parameters)?, parameters.number("w")?).into(),
        "OpenCVModel5" => return Err(fields.invalid(model, not_a_fisheye(model))),
        other => {
            return Err(FormatError::malformed(format!(
                "its model is {other:?}: EUCM, UCM, KannalaBrandt4 and FovCamera are read"
            )));
        }
    };
    let image = parameters.image("width", "height")?;
    Ok(Camera::new(Some(image), lens))
}

/// fisheye-calib-adapter: `image` and `parameter`, the model given by the file's name alone
/// (<https://github.com/eowjd0512/fisheye-calib-adapter>).
///
/// Here the parameters that are present decide. `unprojection` is Scaramuzza's direct polynomial
/// with x along the columns and z out of the lens.
pub(super) fn read_fisheye_calib_adapter(fields: &Fields<'_>) -> Result<Camera, FormatError> {
    let parameters = fields.child("parameter")?;
    let has = |key: &str| parameters.has(key);
    let lens = if has("coefficients") {
        let coefficients = parameters.child("coefficients")?;
        ColumnFirst {
            polynomial: negated(&coefficients.numbers("unprojection")?),
            affine: parameters.each(["c", "d", "e"])?,
            center: parameters.each(["cx", "cy"])?,
        }
        .into_lens()?
        .into()
    } else if has("p1") {
        return Err(fields.invalid(
            "parameter",
            not_a_fisheye("radial and tangential distortion"),
        ));
    } else {
        let model = if has("xi") {
            NamedModel::DoubleSphere
        } else if has("beta") {
            NamedModel::Eucm
        } else if has("alpha") {
            NamedModel::Ucm
        } else if has("k1") {
            NamedModel::KannalaBrandt
        } else {
            return Err(fields.invalid(
                "parameter",
                "its names are those of no model: the parameters of double sphere (xi, alpha), \
                 EUCM (alpha, beta), UCM (alpha), Kannala-Brandt (k1 to k4) and OCamCalib \
                 (coefficients) are read",
            ));
        };
        read_model(model, &parameters)?
    };
    let image = fields.child("image")?.image("width", "height")?;
    Ok(Camera::new(Some(image), lens))
}
