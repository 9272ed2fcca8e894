//! The parts of a report that several crates read and write: the server, the counts, evaluations and
//! annotation formats.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The calibration of a report.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ReportCalibration {
    /// The ID; `assumed` when the request named no calibration.
    pub id: String,
    /// The revision; it changes with the content.
    pub revision: String,
    /// `true` if the request named no calibration and the lens was assumed.
    pub assumed: bool,
    /// The lens circle of the frame, from which the lens was assumed; absent with a calibration.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub assumed_circle: Option<ReportCircle>,
}

/// A lens circle, in pixels of the frame: the corner of the top-left pixel is (0, 0), as in boxes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = LensCircle)]
pub struct ReportCircle {
    /// Column of the center.
    pub cx: f64,
    /// Row of the center.
    pub cy: f64,
    /// Radius; the circle may reach beyond the frame.
    pub radius: f64,
}

/// The frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct ReportImage {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
}

/// Corner-origin frame pixels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ReportOrientedBox {
    /// Horizontal position of the center.
    pub cx: f64,
    /// Vertical position of the center.
    pub cy: f64,
    /// Extent across the height axis.
    pub width: f64,
    /// Extent along the height axis.
    pub height: f64,
    /// Clockwise rotation of the height axis from image up, −90 to 90.
    pub angle_deg: f64,
}

/// A direction from the camera.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ReportBearing {
    /// 0 toward image right, growing clockwise on the screen, 0 to 360.
    pub azimuth_deg: f64,
    /// Angle from the optical axis.
    pub off_axis_deg: f64,
}

/// A position on the floor: origin below the camera, x toward image right and y toward image down
/// of a camera that points straight down.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ReportFloor {
    /// Meters.
    pub x_m: f64,
    /// Meters.
    pub y_m: f64,
}
