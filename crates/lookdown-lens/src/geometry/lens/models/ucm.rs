//! The unified camera model.

use super::eucm::UnifiedCurve;
use crate::geometry::lens::{LensError, check::from_zero_to_one, model::Model};

lens_parameters! {
    /// [`Eucm`](super::Eucm) with `beta` 1. Geyer and Daniilidis 2000, in the parameters of Usenko,
    /// Demmel and Cremers 2018, section 2.2.
    pub struct Ucm: Pinhole {
        /// 0 (pinhole) to 1 (orthographic).
        pub alpha: f64,
    }
}

impl Model for Ucm {
    type Curve = UnifiedCurve;

    fn curve(&self) -> Result<UnifiedCurve, LensError> {
        let alpha = from_zero_to_one((Self::NAME, "alpha"), self.alpha)?;
        Ok(UnifiedCurve { alpha, beta: 1.0 })
    }
}
