//! Lenses whose parameters are named the same way by several programs: `fx fy cx cy` and then the
//! letters of the model's own paper.

use super::{
    FormatError,
    fields::Fields,
    lenses::{Pinhole, double_sphere, eucm, kannala_brandt, ucm},
};
use crate::calibration::native::NativeLens;

/// A model whose parameters have the same names everywhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NamedModel {
    DoubleSphere,
    Eucm,
    Ucm,
    KannalaBrandt,
}

/// Reads the parameters of a model.
pub(super) fn read(model: NamedModel, fields: &Fields<'_>) -> Result<NativeLens, FormatError> {
    let pinhole = pinhole(fields)?;
    Ok(match model {
        NamedModel::DoubleSphere => {
            double_sphere(pinhole, fields.number("xi")?, fields.number("alpha")?)
        }
        NamedModel::Eucm => eucm(pinhole, fields.number("alpha")?, fields.number("beta")?),
        NamedModel::Ucm => ucm(pinhole, fields.number("alpha")?),
        NamedModel::KannalaBrandt => {
            let k = [
                fields.number("k1")?,
                fields.number("k2")?,
                fields.number("k3")?,
                fields.number("k4")?,
            ];
            kannala_brandt(pinhole, k, 0.0)
        }
    })
}

/// `fx fy cx cy`.
pub(super) fn pinhole(fields: &Fields<'_>) -> Result<Pinhole, FormatError> {
    Ok([
        fields.number("fx")?,
        fields.number("fy")?,
        fields.number("cx")?,
        fields.number("cy")?,
    ])
}
