//! Cameras of a site: each camera's place on the common floor plane.

use serde::{Deserialize, Serialize};

/// The place of a camera on the floor plane of its site. A camera alone is at the origin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CameraPose {
    /// The site's coordinates of the floor point below the camera, meters (`mount.position_m`).
    pub position_m: [f64; 2],
    /// Rotation of the camera's floor axes into those of the site, degrees: a yaw of 90 turns the
    /// camera's x axis into the site's y axis (`mount.yaw_deg`).
    pub yaw_deg: f64,
    /// Height of the camera above the floor, meters; absent when it is unknown.
    pub height_m: Option<f64>,
}

impl CameraPose {
    /// Returns the pose of a camera that has its floor to itself: its own axes, at the origin.
    pub fn alone(height_m: Option<f64>) -> Self {
        Self {
            position_m: [0.0, 0.0],
            yaw_deg: 0.0,
            height_m,
        }
    }

    /// Returns the site's coordinates of a floor place of this camera, meters. Lines and zones of
    /// a calibration reach the site's plane through this.
    pub fn to_site(&self, floor_m: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.turned_to_site(floor_m);
        [x + self.position_m[0], y + self.position_m[1]]
    }

    /// Returns the floor place of this camera at the site's coordinates, meters.
    pub fn from_site(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (x, y) = (x - self.position_m[0], y - self.position_m[1]);
        let (sin, cos) = self.yaw_deg.to_radians().sin_cos();
        [cos * x + sin * y, cos * y - sin * x]
    }

    /// Returns a floor vector of this camera in the axes of the site.
    pub(crate) fn turned_to_site(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.yaw_deg.to_radians().sin_cos();
        [cos * x - sin * y, sin * x + cos * y]
    }
}

/// The plane in which a line or zone is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Plane {
    /// Meters on the floor of the site, or of the camera where it is alone.
    FloorM,
    /// Corner-origin frame pixels. Only for a camera that has its tracker to itself.
    FramePx,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_maps_x_to_y() {
        let pose = CameraPose {
            position_m: [10.0, 20.0],
            yaw_deg: 90.0,
            height_m: None,
        };
        let [x, y] = pose.to_site([1.0, 2.0]);
        assert!((x - 8.0).abs() < 1e-9 && (y - 21.0).abs() < 1e-9, "{x} {y}");
        let [x, y] = pose.from_site([x, y]);
        assert!((x - 1.0).abs() < 1e-9 && (y - 2.0).abs() < 1e-9, "{x} {y}");
    }
}
