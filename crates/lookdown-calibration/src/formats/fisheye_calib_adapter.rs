//! fisheye-calib-adapter: `image` and `parameter`, the model given by the file's name alone
//! (<https://github.com/eowjd0512/fisheye-calib-adapter>).
//!
//! Here the parameters that are present decide. `unprojection` is Scaramuzza's direct polynomial
//! with x along the columns and z out of the lens.

use super::{
    Camera, FormatError,
    column_first::{ColumnFirst, negated},
    distortion::not_a_fisheye,
    fields::Fields,
    named_parameters::{self, NamedModel},
};

pub(super) fn read(fields: &Fields<'_>) -> Result<Camera, FormatError> {
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
        named_parameters::read(model, &parameters)?
    };
    let image = fields.child("image")?.image("width", "height")?;
    Ok(Camera::new(Some(image), lens))
}
