//! Basalt: `value0.intrinsics[]` with a `camera_type` each and `value0.resolution[]`
//! (<https://gitlab.com/VladyslavUsenko/basalt-headers>, `calibration.hpp`).

use serde_json::Value;

use super::{
    Camera, FileCamera, FormatError,
    distortion::not_a_fisheye,
    fields::{Fields, whole_pixels},
    named_parameters::{self, NamedModel, pinhole},
};
use crate::native::NativeImage;
use lookdown_lens::geometry::lens::Rectilinear;

pub(super) fn read(fields: &Fields<'_>) -> Result<Vec<FileCamera>, FormatError> {
    let calibration = fields.child("value0")?;
    calibration.get("intrinsics")?;
    let cameras = calibration.entries("intrinsics").enumerate();
    let cameras = cameras.map(|(index, camera)| FileCamera {
        name: Some(format!("cam{index}")),
        camera: camera.and_then(|camera| read_camera(&calibration, index, &camera)),
    });
    Ok(cameras.collect())
}

fn read_camera(
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
            return Ok(Camera::new(Some(image(calibration, index)?), lens));
        }
        other @ "pinhole-radtan8" => {
            return Err(camera.invalid("camera_type", not_a_fisheye(other)));
        }
        other => {
            let problem = format!("it is {other:?}: ds, eucm, ucm, kb4 and pinhole are read");
            return Err(camera.invalid("camera_type", problem));
        }
    };
    let lens = named_parameters::read(model, &parameters)?;
    Ok(Camera::new(Some(image(calibration, index)?), lens))
}

fn image(calibration: &Fields<'_>, index: usize) -> Result<NativeImage, FormatError> {
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
