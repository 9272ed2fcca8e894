//! Virtual views: pinhole cameras that share the fisheye camera's center.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Matrix3, Rotation3, Vector2, Vector3};

use super::{Mount, Pixel, Ray};

/// The direction of a view, relative to the axis its plan is centered on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewDirection {
    /// Angle from the plan's axis, radians. Positive tilts toward image up, then `azimuth` spins.
    pub elevation: f64,
    /// Rotation about the plan's axis, radians, clockwise on the screen.
    pub azimuth: f64,
    /// Full horizontal opening angle, radians, below 180°.
    pub field_of_view: f64,
}

/// A pinhole view of `width` × `height` pixels with square pixels and a central principal point.
#[derive(Debug, Clone, PartialEq)]
pub struct VirtualView {
    /// Rotation from the view frame to the camera frame.
    pub camera_from_view: Rotation3<f64>,
    /// Focal length, pixels.
    pub focal: f64,
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
}

/// Up is undefined in a view whose axis is within this of it (sine of the angle).
const UPRIGHT_MIN_SINE: f64 = 1e-3;
/// A turn that leaves the optical axis by this (radians) is still about it: rounding.
const TURN_TOLERANCE: f64 = 1e-12;

impl VirtualView {
    /// Places a view. `camera_from_view = camera_from_plan · Rz(azimuth) · Rx(elevation)`, so that
    /// with a camera that looks straight down, image up in the view points outward and up: people
    /// stand upright. Under any mount that the plan is not centered on, the view is rolled until
    /// the projected `world_up` points up.
    pub fn new(direction: &ViewDirection, mount: &Mount, width: u32, height: u32) -> Self {
        let spin = Rotation3::from_axis_angle(&Vector3::z_axis(), direction.azimuth);
        let tilt = Rotation3::from_axis_angle(&Vector3::x_axis(), direction.elevation);
        let unrolled = mount.camera_from_plan() * spin * tilt;
        let camera_from_view = if mount.is_near_nadir() {
            unrolled
        } else {
            unrolled * upright_roll(&unrolled, mount)
        };
        Self {
            camera_from_view,
            focal: f64::from(width) / 2.0 / (direction.field_of_view / 2.0).tan(),
            width,
            height,
        }
    }

    /// A view that is upright under any mount: its axis is `tilt` from straight down, toward
    /// `azimuth` (0 toward image right, clockwise on the screen). All angles in radians,
    /// `field_of_view` horizontal and below 180°.
    pub fn leveled(
        azimuth: f64,
        tilt: f64,
        field_of_view: f64,
        mount: &Mount,
        width: u32,
        height: u32,
    ) -> Self {
        let spin = Rotation3::from_axis_angle(&Vector3::z_axis(), azimuth + FRAC_PI_2);
        let tilt = Rotation3::from_axis_angle(&Vector3::x_axis(), tilt);
        Self {
            camera_from_view: mount.camera_from_floor() * spin * tilt,
            focal: f64::from(width) / 2.0 / (field_of_view / 2.0).tan(),
            width,
            height,
        }
    }

    /// A view along a ray (camera frame), `focal` in pixels, with the projected `world_up` as image
    /// up; along the vertical itself, image up is that of the frame.
    pub fn looking_along(axis: &Ray, focal: f64, mount: &Mount, width: u32, height: u32) -> Self {
        let axis = axis.normalize();
        let across = |up: Ray| (up - axis * axis.dot(&up)).try_normalize(UPRIGHT_MIN_SINE);
        let up = across(mount.world_up()).or_else(|| across(-Ray::y()));
        // One of two directions is always across the axis; a third could only be image right.
        let down = -up.unwrap_or_else(Ray::x);
        let columns = Matrix3::from_columns(&[down.cross(&axis), down, axis]);
        Self {
            camera_from_view: Rotation3::from_matrix_unchecked(columns),
            focal,
            width,
            height,
        }
    }

    /// Full horizontal opening angle, radians.
    pub fn field_of_view(&self) -> f64 {
        2.0 * (f64::from(self.width) / 2.0 / self.focal).atan()
    }

    /// Rays (camera frame) along the border, clockwise from the top left corner, that one first and
    /// last; `per_side` steps along each side.
    pub fn border_rays(&self, per_side: u32) -> impl Iterator<Item = Ray> {
        let (right, bottom) = (f64::from(self.width) - 0.5, f64::from(self.height) - 0.5);
        let corners = [(-0.5, -0.5), (right, -0.5), (right, bottom), (-0.5, bottom)];
        (0..=4 * per_side).map(move |step| {
            let (side, along) = (step / per_side, step % per_side);
            let share = f64::from(along) / f64::from(per_side);
            let [(x0, y0), (x1, y1)] = [side, side + 1].map(|corner| corners[corner as usize % 4]);
            self.ray_in_camera(&Pixel::new(x0 + share * (x1 - x0), y0 + share * (y1 - y0)))
        })
    }

    /// The ray (camera frame, not of unit length) through a view pixel (pixel centers).
    pub fn ray_in_camera(&self, pixel: &Pixel) -> Ray {
        self.camera_from_view * self.ray_in_view(pixel)
    }

    /// The ray (view frame, z = 1) through a view pixel (pixel centers).
    pub fn ray_in_view(&self, pixel: &Pixel) -> Ray {
        let principal = self.principal_point();
        Ray::new(
            (pixel.x - principal.x) / self.focal,
            (pixel.y - principal.y) / self.focal,
            1.0,
        )
    }

    /// Returns the point at which a ray (camera frame) meets the view (pixel centers), also beyond
    /// its borders; `None` for rays that point away from it.
    pub fn project(&self, ray_in_camera: &Ray) -> Option<Pixel> {
        let ray = self
            .camera_from_view
            .inverse_transform_vector(ray_in_camera);
        let principal = self.principal_point();
        (ray.z > 0.0).then(|| {
            Pixel::new(
                self.focal * ray.x / ray.z + principal.x,
                self.focal * ray.y / ray.z + principal.y,
            )
        })
    }

    /// Returns true when a ray (camera frame) meets the view within its borders.
    pub fn holds(&self, ray_in_camera: &Ray) -> bool {
        let (right, bottom) = (f64::from(self.width) - 0.5, f64::from(self.height) - 0.5);
        self.project(ray_in_camera).is_some_and(|pixel| {
            (-0.5..=right).contains(&pixel.x) && (-0.5..=bottom).contains(&pixel.y)
        })
    }

    /// The turn about the optical axis (radians, clockwise on the screen) that makes `other` this
    /// view, if there is one.
    pub fn turned_from(&self, other: &Self) -> Option<f64> {
        let is_alike =
            (self.focal, self.width, self.height) == (other.focal, other.width, other.height);
        let turn = self.camera_from_view * other.camera_from_view.inverse();
        let off_axis = turn[(0, 2)].abs().max(turn[(1, 2)].abs());
        let is_about_axis = off_axis <= TURN_TOLERANCE && turn[(2, 2)] > 0.0;
        (is_alike && is_about_axis).then(|| turn[(1, 0)].atan2(turn[(0, 0)]))
    }

    /// The direction (unit length, view pixels) in which a vertical pole seen at `pixel` (pixel
    /// centers) rises; `None` where the view looks along the vertical.
    pub fn vertical_at(&self, pixel: &Pixel, mount: &Mount) -> Option<Vector2<f64>> {
        let up = self
            .camera_from_view
            .inverse_transform_vector(&mount.world_up());
        let ray = self.ray_in_view(pixel);
        // Derivative of the perspective projection along `up`, times the (positive) depth.
        let direction = Vector2::new(up.x - ray.x * up.z, up.y - ray.y * up.z);
        direction.try_normalize(f64::EPSILON)
    }

    /// Returns the point at which the axis meets the view: its middle, pixel centers.
    pub fn principal_point(&self) -> Pixel {
        Pixel::new(
            f64::from(self.width - 1) / 2.0,
            f64::from(self.height - 1) / 2.0,
        )
    }
}

/// The roll about the view axis after which the projected world up is image up.
fn upright_roll(camera_from_view: &Rotation3<f64>, mount: &Mount) -> Rotation3<f64> {
    let up = camera_from_view.inverse_transform_vector(&mount.world_up());
    if up.x.hypot(up.y) < UPRIGHT_MIN_SINE {
        return Rotation3::identity();
    }
    Rotation3::from_axis_angle(&Vector3::z_axis(), up.x.atan2(-up.y))
}

#[cfg(test)]
mod tests;
