//! Lens models: where a ray meets the image, and which ray a pixel saw.
//!
//! Every model here is rotationally symmetric up to an affine map of the image plane: a
//! [`RadialCurve`] gives the normalised radius for the angle `theta` from the optical axis, an
//! [`ImagePlane`] turns normalised coordinates into pixels. A ray or pixel outside the valid range
//! is refused with `None`, never mapped to a made-up place.

mod curve;
mod image_plane;
mod inversion;

pub use curve::RadialCurve;
pub use image_plane::ImagePlane;

use self::inversion::AngleTable;
use super::{Pixel, Ray};

/// Rays this little beyond `max_theta` still count as on the rim: rounding, not geometry.
const RIM_TOLERANCE: f64 = 1e-12;

/// A calibrated lens.
#[derive(Debug, Clone, PartialEq)]
pub struct Lens {
    curve: RadialCurve,
    plane: ImagePlane,
    max_theta: f64,
    max_radius: f64,
    /// Speeds up the inversion of curves that have no closed form.
    angle_table: Option<AngleTable>,
}

/// A lens that cannot be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LensError {
    /// A parameter is NaN or infinite.
    #[error("{name} is {value}: a finite number is needed")]
    NotFinite {
        /// The parameter's name in a calibration file.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// A focal length or a scale is zero or negative.
    #[error("{name} is {value}: it must be greater than 0")]
    NotPositive {
        /// The parameter's name in a calibration file.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// The focal length is missing, or given in two ways.
    #[error("give either focal, or both fx and fy")]
    FocalLengths,
    /// The radius does not grow with the angle at the optical axis.
    #[error(
        "the lens curve of {model} does not rise at the optical axis: check the order and sign of \
         its coefficients"
    )]
    NotRising {
        /// The lens model's name.
        model: &'static str,
    },
    /// A radial polynomial that does not start at the principal point.
    #[error("coefficients[0] is {value}: the radius at the optical axis must be 0")]
    TornAtAxis {
        /// The constant coefficient.
        value: f64,
    },
    /// A radial polynomial of absurd degree.
    #[error("coefficients has {count} entries: between 2 and {limit} are accepted")]
    CoefficientCount {
        /// How many were given.
        count: usize,
        /// The most that are accepted.
        limit: usize,
    },
    /// `max_theta` lies outside the range in which the model maps one to one.
    #[error(
        "max_theta is {value} rad, but this {model} lens is one-to-one only up to {limit:.4} rad: \
         give a value above 0 and at most that"
    )]
    MaxThetaOutOfRange {
        /// The lens model's name.
        model: &'static str,
        /// The value given.
        value: f64,
        /// The largest value the model allows.
        limit: f64,
    },
}

impl Lens {
    /// Builds a lens. Without `max_theta` the lens reaches as far as its curve is one-to-one.
    ///
    /// # Errors
    /// [`LensError`] when a parameter is not finite, a scale is not positive, the curve does not
    /// rise at the axis, or `max_theta` lies beyond the curve's limit.
    pub fn new(
        curve: RadialCurve,
        plane: ImagePlane,
        max_theta: Option<f64>,
    ) -> Result<Self, LensError> {
        curve.check()?;
        plane.check()?;
        let limit = curve.limit();
        if limit <= 0.0 {
            return Err(LensError::NotRising {
                model: curve.name(),
            });
        }
        let max_theta = max_theta.unwrap_or(limit);
        if !(max_theta > 0.0 && max_theta <= limit + RIM_TOLERANCE) {
            return Err(LensError::MaxThetaOutOfRange {
                model: curve.name(),
                value: max_theta,
                limit,
            });
        }
        let max_theta = max_theta.min(limit);
        let angle_table = (!curve.has_closed_inverse()).then(|| AngleTable::new(&curve, max_theta));
        Ok(Self {
            max_radius: curve.radius(max_theta),
            curve,
            plane,
            max_theta,
            angle_table,
        })
    }

    /// The ideal equidistant lens (`r = focal · theta`) whose image is the circle of `radius`
    /// pixels around (`cx`, `cy`) (pixel centres), seeing up to `max_theta` radians off its axis.
    ///
    /// # Errors
    /// [`LensError`] when a value is not finite or not positive.
    pub fn equidistant_circle(
        cx: f64,
        cy: f64,
        radius: f64,
        max_theta: f64,
    ) -> Result<Self, LensError> {
        let focal = radius / max_theta;
        let plane = ImagePlane::new(focal, focal, cx, cy);
        Self::new(RadialCurve::Equidistant, plane, Some(max_theta))
    }

    /// The name of the model, as in calibration files.
    #[must_use]
    pub fn model(&self) -> &'static str {
        self.curve.name()
    }

    /// Where the lens image ends: the largest angle from the optical axis, in radians.
    #[must_use]
    pub fn max_theta(&self) -> f64 {
        self.max_theta
    }

    /// The principal point: where the optical axis meets the image, pixel centres.
    #[must_use]
    pub fn principal_point(&self) -> Pixel {
        Pixel::new(self.plane.cx, self.plane.cy)
    }

    /// The pixel (pixel centres) that sees `ray` (camera frame, any length above 0), or `None`
    /// beyond `max_theta`, exactly behind the camera, or for a ray that is not finite.
    #[must_use]
    pub fn project(&self, ray: &Ray) -> Option<Pixel> {
        let off_axis = ray.x.hypot(ray.y);
        let theta = off_axis.atan2(ray.z);
        if off_axis == 0.0 {
            return (ray.z > 0.0).then(|| self.principal_point());
        }
        if !(theta <= self.max_theta + RIM_TOLERANCE && off_axis.is_finite()) {
            return None;
        }
        let scale = self.curve.radius(theta.min(self.max_theta)) / off_axis;
        Some(
            self.plane
                .pixel_from_normalised(ray.x * scale, ray.y * scale),
        )
    }

    /// Like [`Lens::project`], but a ray beyond `max_theta` is pulled to the rim of the lens image
    /// along its own azimuth. `None` only where there is no azimuth or nothing finite to map.
    #[must_use]
    pub fn project_to_rim(&self, ray: &Ray) -> Option<Pixel> {
        let off_axis = ray.x.hypot(ray.y);
        if off_axis.atan2(ray.z) <= self.max_theta || off_axis == 0.0 {
            return self.project(ray);
        }
        let scale = self.max_radius / off_axis;
        scale.is_finite().then(|| {
            self.plane
                .pixel_from_normalised(ray.x * scale, ray.y * scale)
        })
    }

    /// The unit ray in the camera frame that `pixel` (pixel centres) sees, or `None` outside the
    /// lens image.
    #[must_use]
    pub fn unproject(&self, pixel: &Pixel) -> Option<Ray> {
        let (x, y) = self.plane.normalised_from_pixel(pixel);
        let radius = x.hypot(y);
        if radius == 0.0 {
            return Some(Ray::z());
        }
        // A radius that is no number is not within either.
        let is_within = radius <= self.max_radius * (1.0 + RIM_TOLERANCE);
        if !is_within {
            return None;
        }
        let radius_inside = radius.min(self.max_radius);
        let theta = match &self.angle_table {
            Some(table) => table.angle(&self.curve, radius_inside),
            None => self.curve.closed_inverse(radius_inside),
        };
        let (sin, cos) = theta.sin_cos();
        Some(Ray::new(sin * x / radius, sin * y / radius, cos))
    }

    /// The same lens for a frame `scale_x`, `scale_y` times as large. Pixel centres move with
    /// their corners: the frame's edges stay its edges.
    #[must_use]
    pub fn scaled(&self, scale_x: f64, scale_y: f64) -> Self {
        Self {
            plane: self.plane.scaled(scale_x, scale_y),
            ..self.clone()
        }
    }

    /// The same lens with its image ending at `max_theta`, when that is less than now.
    #[must_use]
    pub fn limited_to(&self, max_theta: f64) -> Self {
        let max_theta = max_theta.min(self.max_theta);
        Self {
            max_theta,
            max_radius: self.curve.radius(max_theta),
            ..self.clone()
        }
    }
}

#[cfg(test)]
mod tests;
