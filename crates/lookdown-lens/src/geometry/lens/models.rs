//! The lens models: each has its formula, symbols, domain, source, parameters and curve. A new
//! model is a line of the list and its parameters. `docs/geometry.md` has the table.

use std::f64::consts::{FRAC_PI_2, PI};

use serde::{Deserialize, Deserializer, Serialize, de::Error};
use serde_json::{Map, Value};

use super::{
    ImagePlane, LensError, Pinhole,
    curve::{Curve, FittedCurve, POLE_MARGIN},
    distortion::RadialTangential,
    error::{above_minus_one, all_finite, finite, from_zero_to_one, in_range, positive},
    inversion::{Polynomial, Rising},
    model::{Model, ideal_plane, one},
};

lens_models! {
    equidistant: Equidistant,
    equisolid: Equisolid,
    stereographic: Stereographic,
    orthographic: Orthographic,
    rectilinear: Rectilinear,
    radial_polynomial: RadialPolynomial,
    kannala_brandt: KannalaBrandt,
    ucm: Ucm,
    eucm: Eucm,
    mei: Mei,
    double_sphere: DoubleSphere,
    ocam: Ocam,
    fov: Fov,
    f_theta: FTheta,
}

/// The model is read first and then its parameters, so that an error names the field.
impl<'de> Deserialize<'de> for LensModel {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut parameters = Map::deserialize(deserializer)?;
        let name = match parameters.remove("model") {
            Some(Value::String(name)) => name,
            Some(_) => {
                return Err(D::Error::custom(
                    "lens.model: give the model's name as text",
                ));
            }
            None => return Err(D::Error::custom("lens: missing field `model`")),
        };
        let mut track = serde_path_to_error::Track::new();
        let parameters = Value::Object(parameters);
        let parameters = serde_path_to_error::Deserializer::new(parameters, &mut track);
        let Some(lens) = Self::deserialize_named(&name, parameters) else {
            // Enough to recognize it by, not enough to fill a log.
            let name: String = name.chars().take(64).collect();
            let known = Self::NAMES.join(", ");
            let problem = format!("lens.model: {name:?} is none of {known}");
            return Err(D::Error::custom(problem));
        };
        lens.map_err(|error| match track.path().to_string() {
            path if path == "." => D::Error::custom(format!("lens: {error}")),
            path => D::Error::custom(format!("lens.{path}: {error}")),
        })
    }
}

lens_parameters! {
    /// The equidistant projection.
    ///
    /// `r = theta`. Valid to 180°.
    pub struct Equidistant: Ideal with EquidistantCurve {
        limit: PI,
        radius: |theta| theta,
        angle: |radius| radius,
    }
}

lens_parameters! {
    /// The equisolid-angle projection: equal solid angles cover equal areas of the image.
    ///
    /// `r = 2 sin(theta / 2)`. Valid to 180°.
    pub struct Equisolid: Ideal with EquisolidCurve {
        limit: PI,
        radius: |theta| 2.0 * (theta / 2.0).sin(),
        angle: |radius| 2.0 * (radius / 2.0).min(1.0).asin(),
    }
}

lens_parameters! {
    /// The stereographic projection, which keeps angles in the image.
    ///
    /// `r = 2 tan(theta / 2)`. Valid below 180°.
    pub struct Stereographic: Ideal with StereographicCurve {
        limit: PI - POLE_MARGIN,
        radius: |theta| 2.0 * (theta / 2.0).tan(),
        angle: |radius| 2.0 * (radius / 2.0).atan(),
    }
}

lens_parameters! {
    /// The orthographic projection.
    ///
    /// `r = sin(theta)`. Valid to 90°.
    pub struct Orthographic: Ideal with OrthographicCurve {
        limit: FRAC_PI_2,
        radius: |theta| theta.sin(),
        angle: |radius| radius.min(1.0).asin(),
    }
}

lens_parameters! {
    /// The rectilinear projection of the pinhole camera.
    ///
    /// `r = tan(theta)`. Valid below 90°.
    pub struct Rectilinear: Ideal with RectilinearCurve {
        limit: FRAC_PI_2 - POLE_MARGIN,
        radius: |theta| theta.tan(),
        angle: |radius| radius.atan(),
    }
}

lens_parameters! {
    /// A polynomial of the angle, as `WoodScape` and MOIL use it.
    ///
    /// `r = c0 + c1 theta + c2 theta² + …` in pixels. Valid up to the first angle at which it stops
    /// rising.
    pub struct RadialPolynomial: Centered {
        /// `c0 … cn`; `c0` is 0.
        pub coefficients: Vec<f64>,
        /// The height of a pixel's step over its width.
        #[serde(default = "one")]
        pub aspect: f64,
    }
}

impl RadialPolynomial {
    /// Creates the lens with these coefficients and center and with square pixels.
    pub fn new(coefficients: Vec<f64>, [cx, cy]: [f64; 2]) -> Self {
        Self {
            coefficients,
            aspect: 1.0,
            cx,
            cy,
            max_theta: None,
        }
    }

    pub(super) fn plane(&self) -> Result<ImagePlane, LensError> {
        let aspect = positive("aspect", self.aspect)?;
        Ok(ImagePlane::new(1.0, aspect, self.cx, self.cy))
    }
}

impl Model for RadialPolynomial {
    type Curve = FittedCurve<Polynomial>;

    fn curve(&self) -> Result<Self::Curve, LensError> {
        let polynomial = Polynomial::from_axis("coefficients", &self.coefficients)?;
        Ok(FittedCurve::radius(polynomial))
    }
}

lens_parameters! {
    /// The odd polynomial of Kannala and Brandt, as OpenCV's fisheye module uses it.
    ///
    /// `r = theta (1 + k1 theta² + k2 theta⁴ + k3 theta⁶ + k4 theta⁸)`. Valid up to the first angle
    /// at which it stops rising. Kannala and Brandt 2006, eq. 6; OpenCV's fisheye module has its
    /// skew as `alpha`, with `skew = fx · alpha`.
    pub struct KannalaBrandt: SkewedPinhole {
        /// `k1 … k4`.
        pub k: [f64; 4],
    }
}

impl Model for KannalaBrandt {
    type Curve = FittedCurve<Polynomial>;

    fn curve(&self) -> Result<Self::Curve, LensError> {
        all_finite("k", &self.k)?;
        let odd_powers = self.k.into_iter().flat_map(|k| [0.0, k]);
        let coefficients = [0.0, 1.0].into_iter().chain(odd_powers).collect();
        Ok(FittedCurve::radius(Polynomial(coefficients)))
    }
}

lens_parameters! {
    /// The unified camera model.
    ///
    /// [`Eucm`] with `beta` 1. Geyer and Daniilidis 2000, in the parameters of Usenko,
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

lens_parameters! {
    /// The enhanced unified camera model.
    ///
    /// `r = sin(theta) / (alpha d + (1 − alpha) cos(theta))`, `d = √(beta sin²(theta) +
    /// cos²(theta))`. Valid while `cos(theta) > −w d`, `w` being the smaller of
    /// `alpha / (1 − alpha)` and its inverse. Khomutenko, Garcia and Martinet 2016.
    pub struct Eucm: Pinhole {
        /// 0 to 1.
        pub alpha: f64,
        /// Above 0.
        pub beta: f64,
    }
}

impl Model for Eucm {
    type Curve = UnifiedCurve;

    fn curve(&self) -> Result<UnifiedCurve, LensError> {
        Ok(UnifiedCurve {
            alpha: from_zero_to_one((Self::NAME, "alpha"), self.alpha)?,
            beta: in_range(
                (Self::NAME, "beta"),
                self.beta,
                |beta| beta > 0.0,
                "above 0",
            )?,
        })
    }
}

/// The curve of `ucm` and `eucm`, and after a shift that of `double_sphere`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnifiedCurve {
    alpha: f64,
    beta: f64,
}

impl UnifiedCurve {
    /// Returns the radius for the vector (`sin`, `cos`), of any length.
    fn radius_of(self, (sin, cos): (f64, f64)) -> f64 {
        let Self { alpha, beta } = self;
        let distance = (beta * sin * sin + cos * cos).sqrt();
        sin / (alpha * distance + (1.0 - alpha) * cos)
    }

    /// Returns the negated cosine at which the curve folds (`alpha` above 1/2) or has its pole.
    fn w(self) -> f64 {
        if self.alpha > 0.5 {
            (1.0 - self.alpha) / self.alpha
        } else {
            self.alpha / (1.0 - self.alpha)
        }
    }

    /// Returns the angle by which the curve ends before its pole, radians; a fold needs none.
    fn margin(self) -> f64 {
        if self.alpha > 0.5 { 0.0 } else { POLE_MARGIN }
    }
}

impl Curve for UnifiedCurve {
    fn limit(&self) -> f64 {
        let w = self.w();
        let limit = (1.0 - w * w).sqrt().atan2(-w * self.beta.sqrt());
        limit - self.margin()
    }

    fn radius(&self, theta: f64) -> f64 {
        self.radius_of(theta.sin_cos())
    }

    fn angle(&self, radius: f64) -> f64 {
        let Self { alpha, beta } = *self;
        let square = beta * radius * radius;
        let bend = 2.0 * alpha - 1.0;
        // Rounding at the very rim must not make the root imaginary.
        let root = (1.0 - bend * square).max(0.0).sqrt();
        // Two forms of one value: the first cancels near alpha = 1/2, the second near alpha = 1.
        let z = if alpha > 0.75 {
            (alpha * root - (1.0 - alpha)) / bend
        } else {
            (1.0 - alpha * alpha * square) / (alpha * root + 1.0 - alpha)
        };
        radius.atan2(z)
    }
}

lens_parameters! {
    /// The sphere model of Mei and Rives: OpenCV's `omnidir`, Kalibr's `omni-radtan`.
    ///
    /// `r = sin(theta) / (cos(theta) + xi)`, then [`RadialTangential`] distortion. Valid while
    /// `cos(theta) > −xi` (`−1 / xi` for `xi > 1`) and the distortion is one-to-one. Mei and Rives
    /// 2007.
    pub struct Mei: SkewedPinhole {
        /// Distance of the projection center from the sphere's center, above −1.
        pub xi: f64,
        /// First radial coefficient.
        pub k1: f64,
        /// Second radial coefficient.
        pub k2: f64,
        /// First tangential coefficient.
        pub p1: f64,
        /// Second tangential coefficient.
        pub p2: f64,
    }
}

impl Model for Mei {
    type Curve = SphereCurve;

    fn curve(&self) -> Result<SphereCurve, LensError> {
        let xi = above_minus_one((Self::NAME, "xi"), self.xi)?;
        Ok(SphereCurve { xi })
    }

    fn distortion(&self) -> Result<Option<RadialTangential>, LensError> {
        let &Self { k1, k2, p1, p2, .. } = self;
        let distortion = RadialTangential { k1, k2, p1, p2 };
        distortion.check()?;
        Ok(Some(distortion))
    }
}

/// The curve before distortion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SphereCurve {
    xi: f64,
}

impl Curve for SphereCurve {
    fn limit(&self) -> f64 {
        if self.xi <= 1.0 {
            (-self.xi).acos() - POLE_MARGIN
        } else {
            (-1.0 / self.xi).acos()
        }
    }

    fn radius(&self, theta: f64) -> f64 {
        let (sin, cos) = theta.sin_cos();
        sin / (self.xi + cos)
    }

    fn angle(&self, radius: f64) -> f64 {
        angle_before_shift(self.xi, radius.atan())
    }
}

/// Returns the angle at the center of the unit sphere of the point that is seen at `shifted` from a
/// center `xi` behind it, by the law of sines.
fn angle_before_shift(xi: f64, shifted: f64) -> f64 {
    shifted + (xi * shifted.sin()).clamp(-1.0, 1.0).asin()
}

lens_parameters! {
    /// The double sphere model.
    ///
    /// `r = sin(theta) / (alpha d + (1 − alpha) g)`, `g = xi + cos(theta)`,
    /// `d = √(sin²(theta) + g²)`. Usenko, Demmel and Cremers 2018, eq. 40 to 45, also for the valid
    /// range.
    pub struct DoubleSphere: Pinhole {
        /// Distance between the two spheres' centers, above −1.
        pub xi: f64,
        /// 0 to 1.
        pub alpha: f64,
    }
}

impl Model for DoubleSphere {
    type Curve = DoubleSphereCurve;

    fn curve(&self) -> Result<DoubleSphereCurve, LensError> {
        let xi = above_minus_one((Self::NAME, "xi"), self.xi)?;
        let alpha = from_zero_to_one((Self::NAME, "alpha"), self.alpha)?;
        let unified = UnifiedCurve { alpha, beta: 1.0 };
        Ok(DoubleSphereCurve { xi, unified })
    }
}

/// A shift of the sphere, then the unified model, whose formula needs no unit vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DoubleSphereCurve {
    xi: f64,
    unified: UnifiedCurve,
}

impl Curve for DoubleSphereCurve {
    /// Returns the published limit, which lies a little inside the fold for ordinary lenses, or the
    /// fold (or pole) itself, whichever comes first.
    fn limit(&self) -> f64 {
        let xi = self.xi;
        let w1 = self.unified.w();
        let w2 = (w1 + xi) / (2.0 * w1 * xi + xi * xi + 1.0).sqrt();
        let fold = if xi <= 1.0 {
            angle_before_shift(xi, (-w1).acos())
        } else {
            (-1.0 / xi).acos()
        };
        (-w2).clamp(-1.0, 1.0).acos().min(fold) - self.unified.margin()
    }

    fn radius(&self, theta: f64) -> f64 {
        let (sin, cos) = theta.sin_cos();
        self.unified.radius_of((sin, self.xi + cos))
    }

    fn angle(&self, radius: f64) -> f64 {
        angle_before_shift(self.xi, self.unified.angle(radius))
    }
}

/// The radius up to which the angle may rise, in units of the focal length: the corner of a
/// frame is never that far out.
const REACH: f64 = 16.0;

lens_parameters! {
    /// Scaramuzza's polynomial, as `OCamCalib` writes it.
    ///
    /// The angle is that of the vector (`r`, `−(a0 + a1 r + a2 r² + …)`), `r` in pixels. Valid
    /// while the angle rises, up to a radius of 16 `|a0|`. Scaramuzza, Martinelli and Siegwart
    /// 2006, with `OCamCalib`'s signs. `column = e · y + x + cx`, `row = c · y + d · x + cy`,
    /// counted from 0.
    pub struct Ocam: Centered {
        /// The direct polynomial, `a0 … an`; `a0` is negative.
        pub polynomial: Vec<f64>,
        /// Stretch of the rows.
        #[serde(default = "one")]
        pub c: f64,
        /// Shift of the row per unit of `x`.
        #[serde(default)]
        pub d: f64,
        /// Shift of the column per unit of `y`.
        #[serde(default)]
        pub e: f64,
    }
}

impl Ocam {
    /// Creates the lens with this polynomial and center and with square pixels.
    pub fn new(polynomial: Vec<f64>, [cx, cy]: [f64; 2]) -> Self {
        Self {
            polynomial,
            c: 1.0,
            d: 0.0,
            e: 0.0,
            cx,
            cy,
            max_theta: None,
        }
    }

    pub(super) fn plane(&self) -> Result<ImagePlane, LensError> {
        Ok(ImagePlane {
            skew: finite("e", self.e)?,
            row_skew: finite("d", self.d)?,
            ..ImagePlane::new(1.0, positive("c", self.c)?, self.cx, self.cy)
        })
    }
}

impl Model for Ocam {
    type Curve = FittedCurve<OcamAngle>;

    fn curve(&self) -> Result<Self::Curve, LensError> {
        let angle = OcamAngle(Polynomial::checked("polynomial", &self.polynomial, 1)?);
        let range = "below 0; OCamCalib's z axis points into the camera";
        let first = (Self::NAME, "polynomial[0]");
        let first = in_range(first, self.polynomial[0], |first| first < 0.0, range)?;
        // At the axis there are `-first` pixels per radian.
        Ok(FittedCurve::angle_up_to(REACH * -first, angle))
    }
}

/// The angle of the vector (`r`, `−p(r)`) from the optical axis.
#[derive(Debug, Clone, PartialEq)]
pub struct OcamAngle(Polynomial);

impl Rising for OcamAngle {
    fn value(&self, radius: f64) -> f64 {
        radius.atan2(-self.0.value(radius))
    }

    fn slope(&self, radius: f64) -> f64 {
        let depth = self.0.value(radius);
        (radius * self.0.slope(radius) - depth) / (radius * radius + depth * depth)
    }
}

lens_parameters! {
    /// The field-of-view model of Devernay and Faugeras.
    ///
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

lens_parameters! {
    /// NVIDIA's f-theta camera.
    ///
    /// The radius in pixels is a polynomial of the angle, or the angle one of the radius: the
    /// calibration declares one of the two as its reference. Valid while the polynomial rises.
    /// `u = c · x + d · y + cx`, `v = e · x + y + cy`.
    pub struct FTheta: Centered {
        /// From radians to pixels, lowest power first; the constant is 0.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub angle_to_pixel: Option<[f64; 6]>,
        /// From pixels to radians, lowest power first; the constant is 0.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub pixel_to_angle: Option<[f64; 6]>,
        /// Stretch of the columns.
        #[serde(default = "one")]
        pub c: f64,
        /// Shift of the column per unit of `y`.
        #[serde(default)]
        pub d: f64,
        /// Shift of the row per unit of `x`.
        #[serde(default)]
        pub e: f64,
    }
}

impl FTheta {
    pub(super) fn plane(&self) -> Result<ImagePlane, LensError> {
        Ok(ImagePlane {
            skew: finite("d", self.d)?,
            row_skew: finite("e", self.e)?,
            ..ImagePlane::new(positive("c", self.c)?, 1.0, self.cx, self.cy)
        })
    }
}

impl Model for FTheta {
    type Curve = FittedCurve<Polynomial>;

    fn curve(&self) -> Result<Self::Curve, LensError> {
        match (&self.angle_to_pixel, &self.pixel_to_angle) {
            (Some(coefficients), None) => {
                let polynomial = Polynomial::from_axis("angle_to_pixel", coefficients)?;
                Ok(FittedCurve::radius(polynomial))
            }
            (None, Some(coefficients)) => {
                let polynomial = Polynomial::from_axis("pixel_to_angle", coefficients)?;
                Ok(FittedCurve::angle(polynomial))
            }
            _ => Err(LensError::new(
                "give either angle_to_pixel or pixel_to_angle, the one that is exact",
            )),
        }
    }
}
