//! Persons and trackers for tests.

use lookdown_lens::geometry::PostureSigns;

use crate::{CameraPose, Observation, Tracker, TrackerSettings};

/// Height of the test cameras, meters.
pub(crate) const CAMERA_M: f64 = 3.0;

/// A surely seen person at a place of the camera's floor.
pub(crate) fn person(x: f64, y: f64) -> Observation {
    with_score(x, y, 0.95)
}

/// A person at a place of the camera's floor.
pub(crate) fn with_score(x: f64, y: f64, score: f64) -> Observation {
    let px = [640.0 + 100.0 * x, 640.0 + 100.0 * y];
    Observation {
        floor_m: Some([x, y]),
        azimuth_deg: y.atan2(x).to_degrees() + 90.0,
        off_axis_deg: x.hypot(y).atan2(CAMERA_M).to_degrees(),
        center_px: px,
        size_px: [40.0, 80.0],
        signs: PostureSigns::default(),
        foot_px: px,
        score,
        is_in_margin: false,
    }
}

/// A tracker of one camera with its height.
pub(crate) fn floor_tracker() -> Tracker {
    Tracker::new(
        &[CameraPose::alone(Some(CAMERA_M))],
        TrackerSettings::default(),
    )
    .unwrap()
}
