//! A camera of a tracker: its pose and the time of its last report.

use lookdown_lens::geometry::Polygon;
use nalgebra::Point2;
use serde::{Deserialize, Serialize};

use crate::{CameraPose, furniture::Furniture};

/// Radius of the floor in which a camera is expected to see a person, in heights of the camera.
const VISIBLE_HEIGHTS: f64 = 4.0;

/// A camera of a tracker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Camera {
    pub pose: CameraPose,
    pub last_report_s: Option<f64>,
    /// The things that stand in its frame.
    pub furniture: Furniture,
    /// The areas of its reports on the site's floor; everywhere if there are none.
    #[serde(skip)]
    pub areas: Vec<Polygon>,
}

impl Camera {
    /// Returns true when a person at this place of the site is expected in the camera's reports.
    pub fn sees(&self, [x, y]: [f64; 2]) -> bool {
        let place = Point2::new(x, y);
        if !self.areas.is_empty() && !self.areas.iter().any(|area| area.holds(place)) {
            return false;
        }
        let [camera_x, camera_y] = self.pose.position_m;
        let distance = (x - camera_x).hypot(y - camera_y);
        self.pose
            .height_m
            .is_none_or(|height| distance <= VISIBLE_HEIGHTS * height)
    }
}
