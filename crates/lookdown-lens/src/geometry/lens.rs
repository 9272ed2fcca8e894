//! Lens models: the pixel that sees a ray, and the ray that a pixel sees.
//!
//! Three stages make every lens: the curve of its [`LensModel`] gives the radius in the normalized
//! plane for the angle `theta` from the optical axis, `mei` then distorts that plane
//! ([`RadialTangential`]), and an affine [`ImagePlane`] turns it into pixels. A ray or pixel
//! outside the valid range is refused with `None`, never mapped to a made-up place.
//!
//! A model is a line of the list in `models.rs` and its parameters there.

use std::f64::consts::PI;

mod curve;
mod distortion;
mod error;
mod image_plane;
mod inversion;
#[macro_use]
mod model;
mod models;

pub use distortion::RadialTangential;
pub use error::LensError;
pub use image_plane::{ImagePlane, Pinhole};
pub use models::*;

use self::{curve::Curve, inversion::first_stationary_point, models::AnyCurve};
use super::{Pixel, Ray};

/// Rays this little beyond `max_theta` still count as on the rim: rounding, not geometry.
const RIM_TOLERANCE: f64 = 1e-12;

/// A calibrated lens.
#[derive(Debug, Clone, PartialEq)]
pub struct Lens {
    curve: AnyCurve,
    distortion: Option<RadialTangential>,
    plane: ImagePlane,
    max_theta: f64,
    /// The radius at `max_theta`, before distortion.
    max_radius: f64,
}

impl Lens {
    /// Builds the lens of `model`, whose parameters are checked here.
    ///
    /// # Errors
    /// [`LensError`] when a parameter is not finite or out of its range, the curve does not rise
    /// at the axis, or `max_theta` lies beyond the model's limit.
    pub fn new(model: &LensModel) -> Result<Self, LensError> {
        Self::on_plane(model, model.plane()?, model.max_theta())
    }

    /// Builds the lens with the curve of `model` and another image plane and end than its own.
    /// Without `max_theta` the lens reaches as far as its model is one-to-one.
    ///
    /// # Errors
    /// [`LensError`], as [`Lens::new`].
    pub fn on_plane(
        model: &LensModel,
        plane: ImagePlane,
        max_theta: Option<f64>,
    ) -> Result<Self, LensError> {
        let (curve, distortion) = model.curve()?;
        plane.check()?;
        let limit = match &distortion {
            None => curve.limit(),
            Some(distortion) => first_stationary_point(
                |theta| distortion.least_stretch(curve.radius(theta)),
                curve.limit(),
            ),
        };
        let max_theta = max_theta.unwrap_or(limit);
        let max_radius = curve.radius(max_theta.min(limit));
        let rises = limit > 0.0 && max_radius.is_finite();
        if !rises {
            return Err(LensError::new(format!(
                "the lens curve of {} does not rise at the optical axis: check the order and sign \
                 of its parameters",
                curve.model()
            )));
        }
        let is_within = max_theta > 0.0 && max_theta <= limit + RIM_TOLERANCE;
        if !is_within {
            return Err(beyond_limit(&curve, max_theta, limit));
        }
        Ok(Self {
            curve,
            distortion,
            plane,
            max_theta: max_theta.min(limit),
            max_radius,
        })
    }

    /// The ideal equidistant lens (`r = focal · theta`) whose image is the circle of `radius`
    /// pixels around (`cx`, `cy`) (pixel centers), seeing up to `max_theta` radians off its axis.
    ///
    /// # Errors
    /// [`LensError`] when a value is not finite or not positive.
    pub fn equidistant_circle(
        cx: f64,
        cy: f64,
        radius: f64,
        max_theta: f64,
    ) -> Result<Self, LensError> {
        Self::new(&Equidistant::with_focal(radius / max_theta, cx, cy, max_theta).into())
    }

    /// The name of the model, as in calibration files.
    pub fn model(&self) -> &'static str {
        self.curve.model()
    }

    /// Returns the end of the lens image: the largest angle from the optical axis, in radians.
    pub fn max_theta(&self) -> f64 {
        self.max_theta
    }

    /// The principal point: where the optical axis meets the image, pixel centers.
    pub fn principal_point(&self) -> Pixel {
        Pixel::new(self.plane.cx, self.plane.cy)
    }

    /// The pixel (pixel centers) that sees `ray` (camera frame, any length above 0), or `None`
    /// beyond `max_theta`, exactly behind the camera, or for a ray that is not finite.
    pub fn project(&self, ray: &Ray) -> Option<Pixel> {
        let off_axis = ray.xy().norm();
        let theta = off_axis.atan2(ray.z);
        if off_axis == 0.0 {
            return (ray.z > 0.0).then(|| self.principal_point());
        }
        if !(theta <= self.max_theta + RIM_TOLERANCE && off_axis.is_finite()) {
            return None;
        }
        self.pixel_at(ray, self.curve.radius(theta.min(self.max_theta)) / off_axis)
    }

    /// Like [`Lens::project`], but a ray beyond `max_theta` is pulled to the rim of the lens image
    /// along its own azimuth. `None` only where there is no azimuth or nothing finite to map.
    pub fn project_to_rim(&self, ray: &Ray) -> Option<Pixel> {
        let off_axis = ray.xy().norm();
        if off_axis.atan2(ray.z) <= self.max_theta || off_axis == 0.0 {
            return self.project(ray);
        }
        self.pixel_at(ray, self.max_radius / off_axis)
    }

    /// The pixel of the point `scale · (x, y)` in the plane before distortion.
    fn pixel_at(&self, ray: &Ray, scale: f64) -> Option<Pixel> {
        let (x, y) = self.distorted(ray.x * scale, ray.y * scale);
        let pixel = self.plane.pixel_from_normalized(x, y);
        (pixel.x.is_finite() && pixel.y.is_finite()).then_some(pixel)
    }

    /// Returns the point at which `ray` (camera frame) meets the normalized plane, which
    /// [`Lens::image_plane`] takes to pixels. Beyond `max_theta` the curve is its own mirror image,
    /// `r(max_theta + t) = 2 r(max_theta) − r(max_theta − t)`: smooth across the rim, but nothing
    /// that the lens sees. `None` exactly behind the camera and where nothing finite comes out.
    pub fn continued_beyond_rim(&self, ray: &Ray) -> Option<Pixel> {
        let off_axis = ray.x.hypot(ray.y);
        if off_axis == 0.0 {
            return (ray.z > 0.0).then(Pixel::origin);
        }
        let theta = off_axis.atan2(ray.z);
        let radius = if theta <= self.max_theta {
            self.curve.radius(theta)
        } else {
            2.0 * self.max_radius - self.curve.radius((2.0 * self.max_theta - theta).max(0.0))
        };
        let scale = radius / off_axis;
        let (x, y) = self.distorted(ray.x * scale, ray.y * scale);
        (x.is_finite() && y.is_finite()).then(|| Pixel::new(x, y))
    }

    fn distorted(&self, x: f64, y: f64) -> (f64, f64) {
        match &self.distortion {
            None => (x, y),
            Some(distortion) => distortion.distort(x, y),
        }
    }

    /// The unit ray in the camera frame that `pixel` (pixel centers) sees, or `None` outside the
    /// lens image.
    pub fn unproject(&self, pixel: &Pixel) -> Option<Ray> {
        let (x, y) = self.plane.normalized_from_pixel(pixel);
        let (x, y) = match &self.distortion {
            None => (x, y),
            Some(distortion) => distortion.undistort(x, y, self.max_radius)?,
        };
        // `hypot` is slower, and only differs far outside of any frame.
        let radius = (x * x + y * y).sqrt();
        if radius == 0.0 {
            return Some(Ray::z());
        }
        // A radius that is not a number is not within either.
        let is_within = radius <= self.max_radius * (1.0 + RIM_TOLERANCE);
        if !is_within {
            return None;
        }
        let (sin, cos) = self.curve.angle(radius.min(self.max_radius)).sin_cos();
        sin.is_finite()
            .then(|| Ray::new(sin * x / radius, sin * y / radius, cos))
    }

    /// The affine map from the normalized plane to pixels.
    pub fn image_plane(&self) -> &ImagePlane {
        &self.plane
    }

    /// Returns true for a lens that is the same in every azimuth, apart from its image plane.
    pub fn is_symmetric(&self) -> bool {
        self.distortion
            .is_none_or(|distortion| distortion.is_radial())
    }

    /// The same lens for a frame `scale_x`, `scale_y` times as large. Pixel centers move with
    /// their corners: the frame's edges stay its edges.
    pub fn scaled(&self, scale_x: f64, scale_y: f64) -> Self {
        Self {
            plane: self.plane.scaled(scale_x, scale_y),
            ..self.clone()
        }
    }

    /// The same lens with its image ending at `max_theta`, when that is less than now.
    pub fn limited_to(&self, max_theta: f64) -> Self {
        let max_theta = max_theta.min(self.max_theta);
        Self {
            max_theta,
            max_radius: self.curve.radius(max_theta),
            ..self.clone()
        }
    }
}

/// Returns the reason for which `max_theta` is refused. The limit is rounded down, so that it may
/// be copied.
fn beyond_limit(curve: &AnyCurve, value: f64, limit: f64) -> LensError {
    let model = curve.model();
    let turns_back = curve.is_polynomial() && value > limit && limit < PI;
    let limit = (limit * 1e4).floor() / 1e4;
    let problem = if turns_back {
        format!(
            "max_theta is {value} rad, but the curve of this {model} lens turns back at {limit} \
             rad: check its coefficients, or give at most that"
        )
    } else {
        format!(
            "max_theta is {value} rad, but this {model} lens is one-to-one only up to {limit} rad: \
             give a value above 0 and at most that"
        )
    };
    LensError::beyond(limit, problem)
}

#[cfg(test)]
mod tests;
