//! The lens models and their parameters, named as in calibration files.

use std::f64::consts::PI;

use super::{
    LensError,
    closed_curve::ClosedCurve,
    distortion::RadialTangential,
    polynomial::{OcamAngle, Polynomial},
    radial_map::RadialMap,
};

/// Most coefficients a polynomial may have; real calibrations have at most a dozen.
const MAX_COEFFICIENTS: usize = 64;

/// A lens model: where a ray at the angle `theta` from the optical axis meets the image.
///
/// `r` is the distance from the principal point in units of the focal length, or in pixels where
/// the model says so; the formulas' domains and sources are in `docs/geometry.md`.
#[derive(Debug, Clone, PartialEq)]
pub enum LensModel {
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
    /// `r = c0 + c1 theta + c2 theta² + …` in pixels, valid up to the first angle at which it
    /// stops rising.
    RadialPolynomial {
        /// `c0 … cn`; `c0` is 0.
        coefficients: Vec<f64>,
    },
    /// `r = theta (1 + k1 theta² + k2 theta⁴ + k3 theta⁶ + k4 theta⁸)`, valid up to the first
    /// angle at which it stops rising (Kannala and Brandt 2006, eq. 6, as used by OpenCV's
    /// fisheye module).
    KannalaBrandt {
        /// `k1 … k4`.
        k: [f64; 4],
    },
    /// Unified camera model: [`LensModel::Eucm`] with `beta` 1 (Geyer and Daniilidis 2000, in the
    /// parameters of Usenko, Demmel and Cremers 2018, section 2.2).
    Ucm {
        /// 0 (pinhole) to 1 (orthographic).
        alpha: f64,
    },
    /// Enhanced unified camera model: `r = sin(theta) / (alpha d + (1 − alpha) cos(theta))`,
    /// `d = √(beta sin²(theta) + cos²(theta))` (Khomutenko, Garcia and Martinet 2016). Valid while
    /// `cos(theta) > −w d`, `w` being the smaller of `alpha / (1 − alpha)` and its inverse.
    Eucm {
        /// 0 to 1.
        alpha: f64,
        /// Above 0.
        beta: f64,
    },
    /// `r = sin(theta) / (cos(theta) + xi)`, then radial and tangential distortion (Mei and Rives
    /// 2007; OpenCV's `omnidir`, Kalibr's `omni-radtan`). Valid while `cos(theta) > −xi`
    /// (`−1 / xi` for `xi > 1`) and the distortion is one-to-one.
    Mei {
        /// Distance of the projection centre from the sphere's centre, above −1.
        xi: f64,
        /// What happens to the point in the normalised plane.
        distortion: RadialTangential,
    },
    /// Double sphere: `r = sin(theta) / (alpha d + (1 − alpha) g)`, `g = xi + cos(theta)`,
    /// `d = √(sin²(theta) + g²)` (Usenko, Demmel and Cremers 2018, eq. 40 to 45, also for the
    /// valid range).
    DoubleSphere {
        /// Distance between the two spheres' centres, above −1.
        xi: f64,
        /// 0 to 1.
        alpha: f64,
    },
    /// The angle is that of the vector (`r`, `−(a0 + a1 r + a2 r² + …)`), `r` in pixels
    /// (Scaramuzza, Martinelli and Siegwart 2006, with `OCamCalib`'s signs). Valid while the angle
    /// rises, up to a radius of 16 `|a0|`.
    Ocam {
        /// `a0 … an`; `a0` is negative.
        polynomial: Vec<f64>,
    },
    /// `r = atan(2 tan(omega / 2) tan(theta)) / omega` (Devernay and Faugeras 2001), continued
    /// beyond 90° to 180°.
    Fov {
        /// Radians, above 0 and below π.
        omega: f64,
    },
    /// The radius in pixels is a polynomial of the angle, or the angle one of the radius (NVIDIA's
    /// f-theta camera). Valid while the polynomial rises.
    FTheta(FThetaPolynomial),
}

/// The polynomial by which an f-theta lens is defined, lowest power first; its constant is 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FThetaPolynomial {
    /// From radians to pixels.
    AngleToPixel([f64; 6]),
    /// From pixels to radians.
    PixelToAngle([f64; 6]),
}

impl LensModel {
    /// The model's name in calibration files.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Equidistant => "equidistant",
            Self::Equisolid => "equisolid",
            Self::Stereographic => "stereographic",
            Self::Orthographic => "orthographic",
            Self::Rectilinear => "rectilinear",
            Self::RadialPolynomial { .. } => "radial_polynomial",
            Self::KannalaBrandt { .. } => "kannala_brandt",
            Self::Ucm { .. } => "ucm",
            Self::Eucm { .. } => "eucm",
            Self::Mei { .. } => "mei",
            Self::DoubleSphere { .. } => "double_sphere",
            Self::Ocam { .. } => "ocam",
            Self::Fov { .. } => "fov",
            Self::FTheta(_) => "f_theta",
        }
    }

    /// Whether the parameters are a fitted polynomial, which may turn back anywhere.
    pub(super) fn is_polynomial(&self) -> bool {
        matches!(
            self,
            Self::RadialPolynomial { .. }
                | Self::KannalaBrandt { .. }
                | Self::Ocam { .. }
                | Self::FTheta(_)
        )
    }

    /// The checked curve of the model, and its distortion.
    pub(super) fn into_parts(self) -> Result<(RadialMap, Option<RadialTangential>), LensError> {
        let model = self.name();
        let in_unit = |name, value: f64| {
            let accepted = (0.0..=1.0).contains(&value);
            let range = "from 0 to 1";
            in_range(model, name, value, accepted, range)
        };
        let above_minus_one =
            |name, value: f64| in_range(model, name, value, value > -1.0, "above -1");
        let closed = match self {
            Self::Equidistant => ClosedCurve::Equidistant,
            Self::Equisolid => ClosedCurve::Equisolid,
            Self::Stereographic => ClosedCurve::Stereographic,
            Self::Orthographic => ClosedCurve::Orthographic,
            Self::Rectilinear => ClosedCurve::Rectilinear,
            Self::Ucm { alpha } => {
                in_unit("alpha", alpha)?;
                ClosedCurve::Unified { alpha, beta: 1.0 }
            }
            Self::Eucm { alpha, beta } => {
                in_unit("alpha", alpha)?;
                in_range(model, "beta", beta, beta > 0.0, "above 0")?;
                ClosedCurve::Unified { alpha, beta }
            }
            Self::DoubleSphere { xi, alpha } => {
                above_minus_one("xi", xi)?;
                in_unit("alpha", alpha)?;
                ClosedCurve::DoubleSphere { xi, alpha }
            }
            Self::Fov { omega } => {
                let accepted = omega > 0.0 && omega < PI;
                let range = "radians above 0 and below 3.1416";
                in_range(model, "omega", omega, accepted, range)?;
                ClosedCurve::Fov { omega }
            }
            Self::Mei { xi, distortion } => {
                above_minus_one("xi", xi)?;
                distortion.check()?;
                return Ok((
                    RadialMap::Closed(ClosedCurve::Sphere { xi }),
                    Some(distortion),
                ));
            }
            Self::RadialPolynomial { coefficients } => {
                let polynomial = from_axis("coefficients", coefficients)?;
                return Ok((RadialMap::radius_from(polynomial), None));
            }
            Self::KannalaBrandt { k } => {
                all_finite("k", &k)?;
                let odd_powers = k.into_iter().flat_map(|k| [0.0, k]);
                let coefficients = [0.0, 1.0].into_iter().chain(odd_powers).collect();
                return Ok((RadialMap::radius_from(Polynomial(coefficients)), None));
            }
            Self::FTheta(FThetaPolynomial::AngleToPixel(coefficients)) => {
                let polynomial = from_axis("angle_to_pixel", coefficients.to_vec())?;
                return Ok((RadialMap::radius_from(polynomial), None));
            }
            Self::FTheta(FThetaPolynomial::PixelToAngle(coefficients)) => {
                let polynomial = from_axis("pixel_to_angle", coefficients.to_vec())?;
                return Ok((RadialMap::angle_from(polynomial), None));
            }
            Self::Ocam { polynomial } => {
                count("polynomial", &polynomial, 1)?;
                all_finite("polynomial", &polynomial)?;
                let first = polynomial[0];
                let range = "below 0; OCamCalib's z axis points into the camera";
                in_range(model, "polynomial[0]", first, first < 0.0, range)?;
                let angle = OcamAngle(Polynomial(polynomial));
                return Ok((RadialMap::ocam(angle), None));
            }
        };
        Ok((RadialMap::Closed(closed), None))
    }
}

fn in_range(
    model: &'static str,
    name: &'static str,
    value: f64,
    accepted: bool,
    range: &'static str,
) -> Result<(), LensError> {
    if !value.is_finite() {
        return Err(LensError::NotFinite { name, value });
    }
    if accepted {
        return Ok(());
    }
    Err(LensError::OutOfRange {
        model,
        name,
        value,
        range,
    })
}

fn all_finite(name: &'static str, values: &[f64]) -> Result<(), LensError> {
    match values.iter().find(|value| !value.is_finite()) {
        Some(&value) => Err(LensError::NotFinite { name, value }),
        None => Ok(()),
    }
}

fn count(name: &'static str, coefficients: &[f64], least: usize) -> Result<(), LensError> {
    if (least..=MAX_COEFFICIENTS).contains(&coefficients.len()) {
        return Ok(());
    }
    Err(LensError::CoefficientCount {
        name,
        count: coefficients.len(),
        least,
        most: MAX_COEFFICIENTS,
    })
}

/// The polynomial, which must be 0 at the optical axis.
fn from_axis(name: &'static str, coefficients: Vec<f64>) -> Result<Polynomial, LensError> {
    count(name, &coefficients, 2)?;
    all_finite(name, &coefficients)?;
    let value = coefficients[0];
    if value != 0.0 {
        return Err(LensError::TornAtAxis { name, value });
    }
    Ok(Polynomial(coefficients))
}
