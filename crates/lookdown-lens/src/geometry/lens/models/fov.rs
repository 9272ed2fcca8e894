//! The field-of-view model of Devernay and Faugeras.

use std::f64::consts::PI;

use crate::geometry::lens::{LensError, check::in_range, curve::Curve, model::Model};

lens_parameters! {
    /// `r = atan(2 tan(omega / 2) tan(theta)) / omega`, continued beyond 90° to 180°. Devernay and
    /// Faugeras 2001.
    pub struct Fov: Pinhole {
        /// Radians, above 0 and below π.
        pub omega: f64,
    }
}

impl Model for Fov {
    type Curve = FovCurve;

    fn curve(&self) -> Result<FovCurve, LensError> {
        let is_accepted = |omega| omega > 0.0 && omega < PI;
        let range = "radians above 0 and below 3.1416";
        let omega = in_range((Self::NAME, "omega"), self.omega, is_accepted, range)?;
        Ok(FovCurve { omega })
    }
}

/// The checked curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FovCurve {
    omega: f64,
}

impl Curve for FovCurve {
    fn limit(&self) -> f64 {
        PI
    }

    fn radius(&self, theta: f64) -> f64 {
        let (sin, cos) = theta.sin_cos();
        (2.0 * (self.omega / 2.0).tan() * sin).atan2(cos) / self.omega
    }

    fn angle(&self, radius: f64) -> f64 {
        let (sin, cos) = (radius * self.omega).sin_cos();
        sin.atan2(2.0 * (self.omega / 2.0).tan() * cos)
    }
}
