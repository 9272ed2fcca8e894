//! Radial curves: the normalised image radius as a function of the angle from the optical axis.

use std::f64::consts::{FRAC_PI_2, PI};

use super::{LensError, inversion::first_stationary_point};

/// Curves with a pole end this far before it, in radians.
const POLE_MARGIN: f64 = 1e-6;

/// Most coefficients a polynomial may have; real calibrations have at most a dozen.
const MAX_COEFFICIENTS: usize = 64;

/// The normalised radius `r(theta)`, in units of the focal length.
#[derive(Debug, Clone, PartialEq)]
pub enum RadialCurve {
    /// `r = theta`: what most ceiling fisheyes approximate. Valid to 180°.
    Equidistant,
    /// `r = 2 sin(theta / 2)`. Valid to 180°.
    Equisolid,
    /// `r = 2 tan(theta / 2)`. Valid below 180°.
    Stereographic,
    /// `r = sin(theta)`. Valid to 90°.
    Orthographic,
    /// `r = tan(theta)`: the pinhole camera. Valid below 90°.
    Rectilinear,
    /// `r = theta (1 + k1 theta² + k2 theta⁴ + k3 theta⁶ + k4 theta⁸)`, valid up to the first
    /// angle at which it stops rising (Kannala and Brandt 2006, eq. 6, as used by OpenCV's
    /// fisheye module).
    KannalaBrandt {
        /// `k1 … k4`.
        k: [f64; 4],
    },
    /// `r = c0 + c1 theta + c2 theta² + …`, valid up to the first angle at which it stops rising.
    /// Calibration files give it in pixels (image plane scale 1).
    Polynomial {
        /// `c0 … cn`.
        coefficients: Vec<f64>,
    },
}

impl RadialCurve {
    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::Equidistant => "equidistant",
            Self::Equisolid => "equisolid",
            Self::Stereographic => "stereographic",
            Self::Orthographic => "orthographic",
            Self::Rectilinear => "rectilinear",
            Self::KannalaBrandt { .. } => "kannala_brandt",
            Self::Polynomial { .. } => "radial_polynomial",
        }
    }

    pub(super) fn check(&self) -> Result<(), LensError> {
        let (name, values): (_, &[f64]) = match self {
            Self::KannalaBrandt { k } => ("k", k),
            Self::Polynomial { coefficients } => ("coefficients", coefficients),
            _ => return Ok(()),
        };
        if let Some(&value) = values.iter().find(|value| !value.is_finite()) {
            return Err(LensError::NotFinite { name, value });
        }
        if let Self::Polynomial { coefficients } = self {
            if !(2..=MAX_COEFFICIENTS).contains(&coefficients.len()) {
                return Err(LensError::CoefficientCount {
                    count: coefficients.len(),
                    limit: MAX_COEFFICIENTS,
                });
            }
            if coefficients[0] != 0.0 {
                return Err(LensError::TornAtAxis {
                    value: coefficients[0],
                });
            }
        }
        Ok(())
    }

    /// The normalised radius at `theta` radians.
    pub(super) fn radius(&self, theta: f64) -> f64 {
        match self {
            Self::Equidistant => theta,
            Self::Equisolid => 2.0 * (theta / 2.0).sin(),
            Self::Stereographic => 2.0 * (theta / 2.0).tan(),
            Self::Orthographic => theta.sin(),
            Self::Rectilinear => theta.tan(),
            Self::KannalaBrandt {
                k: [k1, k2, k3, k4],
            } => {
                let t2 = theta * theta;
                theta * (1.0 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))))
            }
            Self::Polynomial { coefficients } => coefficients
                .iter()
                .rev()
                .fold(0.0, |sum, coefficient| sum * theta + coefficient),
        }
    }

    /// `dr / dtheta` at `theta` radians.
    pub(super) fn slope(&self, theta: f64) -> f64 {
        match self {
            Self::Equidistant => 1.0,
            Self::Equisolid => (theta / 2.0).cos(),
            Self::Stereographic => (theta / 2.0).cos().powi(-2),
            Self::Orthographic => theta.cos(),
            Self::Rectilinear => theta.cos().powi(-2),
            Self::KannalaBrandt {
                k: [k1, k2, k3, k4],
            } => {
                let t2 = theta * theta;
                1.0 + t2 * (3.0 * k1 + t2 * (5.0 * k2 + t2 * (7.0 * k3 + t2 * 9.0 * k4)))
            }
            Self::Polynomial { coefficients } => {
                let powers = (1..coefficients.len()).rev();
                powers.fold(0.0, |sum, power| {
                    #[expect(clippy::cast_precision_loss, reason = "a power below 64")]
                    let factor = power as f64;
                    sum * theta + factor * coefficients[power]
                })
            }
        }
    }

    /// The largest angle up to which the curve is one-to-one; 0 when it never rises.
    pub(super) fn limit(&self) -> f64 {
        match self {
            Self::Equidistant | Self::Equisolid => PI,
            Self::Stereographic => PI - POLE_MARGIN,
            Self::Orthographic => FRAC_PI_2,
            Self::Rectilinear => FRAC_PI_2 - POLE_MARGIN,
            Self::KannalaBrandt { .. } | Self::Polynomial { .. } => {
                first_stationary_point(|theta| self.slope(theta), PI)
            }
        }
    }

    pub(super) fn has_closed_inverse(&self) -> bool {
        !matches!(self, Self::KannalaBrandt { .. } | Self::Polynomial { .. })
    }

    /// The angle at which the curve reaches `radius`, for curves with a closed inverse; for the
    /// others the equidistant angle, a starting point at best.
    pub(super) fn closed_inverse(&self, radius: f64) -> f64 {
        match self {
            Self::Equisolid => 2.0 * (radius / 2.0).min(1.0).asin(),
            Self::Stereographic => 2.0 * (radius / 2.0).atan(),
            Self::Orthographic => radius.min(1.0).asin(),
            Self::Rectilinear => radius.atan(),
            Self::Equidistant | Self::KannalaBrandt { .. } | Self::Polynomial { .. } => radius,
        }
    }
}
