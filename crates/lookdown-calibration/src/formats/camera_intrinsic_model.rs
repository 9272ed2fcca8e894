//! The Rust crate `camera-intrinsic-model`: one map, named after the model
//! (<https://github.com/powei-lin/camera-intrinsic-model-rs>).

use super::{
    Camera, FormatError,
    distortion::not_a_fisheye,
    fields::Fields,
    named_parameters::{self, NamedModel, pinhole},
};
use lookdown_lens::geometry::lens::Fov;

pub(super) fn read(fields: &Fields<'_>) -> Result<Camera, FormatError> {
    let model = fields.map.keys().next().map_or("", String::as_str);
    let parameters = fields.child(model)?;
    let lens = match model {
        "EUCM" => named_parameters::read(NamedModel::Eucm, &parameters)?,
        "UCM" => named_parameters::read(NamedModel::Ucm, &parameters)?,
        "KannalaBrandt4" => named_parameters::read(NamedModel::KannalaBrandt, &parameters)?,
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
