//! Lenses whose parameters are named the same way by several programs: `fx fy cx cy` and then the
//! letters of the model's own paper.

use super::{FormatError, fields::Fields};
use lookdown_lens::geometry::lens::{DoubleSphere, Eucm, KannalaBrandt, LensModel, Pinhole, Ucm};

/// A model whose parameters have the same names everywhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NamedModel {
    DoubleSphere,
    Eucm,
    Ucm,
    KannalaBrandt,
}

/// Reads the parameters of a model.
pub(super) fn read(model: NamedModel, fields: &Fields<'_>) -> Result<LensModel, FormatError> {
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
