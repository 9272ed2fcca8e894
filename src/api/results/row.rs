//! A camera with its latest report, in a line.

use jiff::Timestamp;
use serde::Serialize;
use utoipa::ToSchema;

use crate::results::StoredReport;

/// A camera and what was seen last.
#[derive(Debug, Serialize, ToSchema)]
pub(in crate::api) struct CameraRow {
    /// The camera's name.
    #[schema(example = "lobby")]
    pub(super) camera: String,
    /// The ID of its latest report: its `ETag`, without the quotes.
    #[schema(example = "1763717400412345")]
    id: String,
    /// When the frame of that arrived (RFC 3339).
    #[schema(format = DateTime, example = "2025-11-21T09:30:00.412Z")]
    received_at: String,
    /// Seconds since the report was there.
    #[schema(minimum = 0, example = 0.731)]
    age_seconds: f64,
    /// How many persons are in it.
    #[schema(example = 3)]
    persons: usize,
}

impl CameraRow {
    pub(super) fn at(latest: &StoredReport, now: Timestamp) -> Self {
        let age = now.duration_since(latest.id.time()).as_secs_f64();
        Self {
            camera: latest.report.camera.clone(),
            id: latest.id.to_string(),
            received_at: format!("{:.3}", latest.report.received_at),
            // The clock may have been set back meanwhile.
            age_seconds: (age.max(0.0) * 1000.0).round() / 1000.0,
            persons: latest.report.persons,
        }
    }
}
