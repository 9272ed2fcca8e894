//! A lens continued beyond its rim, so that positions up to the rim can be interpolated.

use super::{Lens, curve::Curve};
use crate::geometry::{Pixel, Ray};

impl Lens {
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::lens::{ImagePlane, Stereographic};

    fn stereographic(plane: ImagePlane) -> Lens {
        let model = Stereographic::with_focal(1.0, 0.0, 0.0, 1.4);
        Lens::on_plane(&model.into(), plane, Some(1.4)).unwrap()
    }

    fn at(theta: f64) -> Ray {
        Ray::new(theta.sin() * 0.6, theta.sin() * 0.8, theta.cos())
    }

    #[test]
    fn within_the_rim_it_is_the_lens_itself() {
        let plane = ImagePlane::new(210.0, 205.0, 299.5, 301.25);
        let lens = stereographic(plane);
        for theta in [0.0, 0.3, 1.399] {
            let normalized = lens.continued_beyond_rim(&at(theta)).unwrap();
            let pixel = plane.pixel_from_normalized(normalized.x, normalized.y);
            assert!((pixel - lens.project(&at(theta)).unwrap()).norm() < 1e-9);
        }
    }

    #[test]
    fn continuation_keeps_the_slope_at_the_rim() {
        let plane = ImagePlane::new(1.0, 1.0, 0.0, 0.0);
        let lens = stereographic(plane);
        let radius = |theta: f64| lens.continued_beyond_rim(&at(theta)).unwrap().coords.norm();
        let rim = radius(1.4);
        assert!((radius(1.5) - rim - (rim - radius(1.3))).abs() < 1e-12);
        assert!(
            (radius(3.0) - 2.0 * rim).abs() < 1e-12,
            "it ends where the curve began"
        );
    }

    #[test]
    fn there_is_no_place_for_what_is_exactly_behind_or_not_finite() {
        let lens = Lens::equidistant_circle(0.0, 0.0, 1.0, 1.5).unwrap();
        assert_eq!(lens.continued_beyond_rim(&-Ray::z()), None);
        assert_eq!(
            lens.continued_beyond_rim(&Ray::new(f64::NAN, 0.0, 1.0)),
            None
        );
        assert_eq!(lens.continued_beyond_rim(&Ray::z()), Some(Pixel::origin()));
    }
}
