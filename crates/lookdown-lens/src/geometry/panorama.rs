//! Panoramas: the ring around the nadir, unrolled.

use std::f64::consts::TAU;

use nalgebra::Rotation3;

use super::{Mount, Pixel, Ray};

/// A conformal cylinder about the vertical (the Mercator projection): people stand upright and keep
/// their proportions in all of it, and poles are vertical lines.
#[derive(Debug, Clone, PartialEq)]
pub struct Panorama {
    camera_from_floor: Rotation3<f64>,
    azimuth: f64,
    radians_per_pixel: f64,
    /// The conformal latitude of the upper border.
    top: f64,
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
}

impl Panorama {
    /// A panorama of `width` × `height` pixels. `azimuth` is that of its middle and `span` its
    /// width, both in radians; azimuths are 0 toward image right and grow to the right. `tilt` is
    /// the angle of its upper border from straight down, above 0 and below 180°. The angle of the
    /// lower border follows from the proportions.
    pub fn new(azimuth: f64, span: f64, tilt: f64, mount: &Mount, width: u32, height: u32) -> Self {
        Self {
            camera_from_floor: mount.camera_from_floor(),
            azimuth,
            radians_per_pixel: span / f64::from(width),
            top: latitude(tilt),
            width,
            height,
        }
    }

    /// The width of a whole turn, pixels.
    pub fn turn(&self) -> f64 {
        TAU / self.radians_per_pixel
    }

    /// The ray (camera frame, unit length) through a pixel (pixel centers).
    pub fn ray_in_camera(&self, pixel: &Pixel) -> Ray {
        let right = pixel.x + 0.5 - f64::from(self.width) / 2.0;
        let (azimuth_sin, azimuth_cos) = (self.azimuth + right * self.radians_per_pixel).sin_cos();
        let latitude = self.top - (pixel.y + 0.5) * self.radians_per_pixel;
        let (tilt_sin, tilt_cos) = (2.0 * latitude.exp().atan()).sin_cos();
        self.camera_from_floor * Ray::new(tilt_sin * azimuth_cos, tilt_sin * azimuth_sin, tilt_cos)
    }

    /// Returns the point at which a ray (camera frame) meets the panorama (pixel centers), within
    /// half a turn of its middle, also beyond its borders; `None` along the vertical.
    pub fn project(&self, ray_in_camera: &Ray) -> Option<Pixel> {
        let ray = self
            .camera_from_floor
            .inverse_transform_vector(ray_in_camera);
        let across = ray.x.hypot(ray.y);
        let (sin, cos) = (ray.y.atan2(ray.x) - self.azimuth).sin_cos();
        let down = (self.top - latitude(across.atan2(ray.z))) / self.radians_per_pixel;
        (across > 1e-9 * ray.z.abs()).then(|| {
            let right = sin.atan2(cos) / self.radians_per_pixel;
            Pixel::new(right + f64::from(self.width) / 2.0 - 0.5, down - 0.5)
        })
    }
}

/// The conformal latitude of an angle from straight down, radians.
fn latitude(tilt: f64) -> f64 {
    (tilt / 2.0).tan().ln()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use nalgebra::{Unit, Vector3};

    use super::*;

    /// A camera that is 10° off level.
    fn mount() -> Mount {
        let up = Vector3::new(0.1, -0.15, -1.0);
        Mount::new(Unit::new_normalize(up), None)
    }

    #[test]
    fn pixels_and_rays_agree_and_poles_are_vertical() {
        let panorama = Panorama::new(0.7, TAU, 1.4, &mount(), 800, 240);
        for (x, y) in [(0.0, 0.0), (399.5, 120.0), (799.0, 239.0)] {
            let ray = panorama.ray_in_camera(&Pixel::new(x, y));
            let seen = panorama.project(&ray).unwrap();
            assert!((seen - Pixel::new(x, y)).norm() < 1e-9, "{seen}");
            // A pole through the point: up is straight up in the panorama.
            let above = panorama.project(&(ray + 0.1 * mount().world_up())).unwrap();
            assert!((above.x - x).abs() < 1e-9 && above.y < y, "{above}");
        }
        assert!(panorama.project(&mount().nadir()).is_none());
    }

    #[test]
    fn a_leveled_view_looks_where_it_is_asked_to() {
        for (azimuth, tilt) in [(0.0, 0.8), (FRAC_PI_2, 1.3), (4.0, 0.0)] {
            let mount = Mount::default();
            let view = super::super::VirtualView::leveled(azimuth, tilt, 1.0, &mount, 101, 51);
            let ray = view.ray_in_camera(&view.principal_point());
            let (sin, cos) = azimuth.sin_cos();
            let wanted = Ray::new(tilt.sin() * cos, tilt.sin() * sin, tilt.cos());
            assert!((ray.normalize() - wanted).norm() < 1e-12, "{ray}");
            assert!((view.field_of_view() - 1.0).abs() < 1e-12);
        }
    }
}
