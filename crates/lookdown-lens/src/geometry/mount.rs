//! The mount of a camera: the direction of up in its frame, and its height above the floor.

use nalgebra::{Rotation3, Unit, Vector3};

use super::Ray;

/// A camera tilted by no more than this from straight down gets a plan centered on the nadir.
const NEAR_NADIR: f64 = 30.0 * std::f64::consts::PI / 180.0;

/// The camera's orientation and height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mount {
    world_up: Unit<Vector3<f64>>,
    height_m: Option<f64>,
}

impl Default for Mount {
    /// A ceiling camera looking straight down, at unknown height.
    fn default() -> Self {
        Self {
            world_up: -Vector3::z_axis(),
            height_m: None,
        }
    }
}

impl Mount {
    /// A mount with the direction of up in the camera frame (a ceiling camera looking straight
    /// down: `(0, 0, -1)`) and the height above the floor in meters, when known.
    pub fn new(world_up: Unit<Vector3<f64>>, height_m: Option<f64>) -> Self {
        Self { world_up, height_m }
    }

    /// Up, in the camera frame.
    pub fn world_up(&self) -> Ray {
        *self.world_up
    }

    /// Straight down, in the camera frame.
    pub fn nadir(&self) -> Ray {
        -*self.world_up
    }

    /// Height of the camera above the floor, meters.
    pub fn height_m(&self) -> Option<f64> {
        self.height_m
    }

    /// Returns true when the camera looks down to within 30°: view plans are then centered on the
    /// nadir.
    pub fn is_near_nadir(&self) -> bool {
        self.nadir().angle(&Ray::z()) <= NEAR_NADIR
    }

    /// The frame in which view plans are laid out: its z axis is the nadir for a camera that
    /// looks down to within 30°, otherwise the optical axis.
    pub fn camera_from_plan(&self) -> Rotation3<f64> {
        if self.is_near_nadir() {
            self.camera_from_floor()
        } else {
            Rotation3::identity()
        }
    }

    /// The leveled camera frame: z straight down, x and y as image right and image down would be
    /// if the camera were turned to look straight down by the smallest rotation.
    pub fn camera_from_floor(&self) -> Rotation3<f64> {
        Rotation3::rotation_between(&Ray::z(), &self.nadir()).unwrap_or_else(|| {
            // A camera that looks straight up: any half turn will do.
            Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
        })
    }
}

/// The place of a camera on the floor of a site.
#[derive(Debug, Clone, PartialEq)]
pub struct SitePlacement {
    /// The name of the site.
    pub site: String,
    /// The floor point below the camera, in meters of the site (x, y).
    pub position_m: [f64; 2],
    /// The angle from the x axis of the site to the x axis of the camera's floor, in degrees. It
    /// grows from x to y, so clockwise where y points down.
    pub yaw_deg: f64,
}
