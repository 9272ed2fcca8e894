//! The lens that was found in the edges of frames.

use lookdown_lens::self_calibration::RoomFit;
use serde::Serialize;
use utoipa::ToSchema;

use crate::{
    room_calibration::tilt_deg,
    rounding::{degrees, pixels, share},
};

/// The lens that was found.
#[derive(Serialize, ToSchema)]
pub(super) struct FoundLens {
    /// Field of view of the lens circle, degrees.
    #[schema(example = 183.2)]
    field_of_view_deg: f64,
    /// Angle between the axis of the camera and straight down, degrees.
    #[schema(example = 4.1)]
    tilt_deg: f64,
    /// Number of edges in the frames.
    edges: usize,
    /// Share of the length of the edges along three orthogonal directions, 0 to 1.
    #[schema(example = 0.71)]
    explained: f64,
}

impl From<&RoomFit> for FoundLens {
    fn from(fit: &RoomFit) -> Self {
        Self {
            field_of_view_deg: degrees(2.0 * fit.max_theta),
            tilt_deg: pixels(tilt_deg(fit)),
            edges: fit.edges,
            explained: share(fit.explained),
        }
    }
}
