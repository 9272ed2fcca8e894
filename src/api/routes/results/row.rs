//! A camera in the list of results.

use jiff::Timestamp;
use serde::Serialize;
use utoipa::ToSchema;

use crate::results::{Headline, StoredReport};

/// A camera and its latest report.
#[derive(Debug, Serialize, ToSchema)]
pub(in crate::api) struct CameraRow {
    /// The name of the camera.
    #[schema(example = "lobby")]
    pub(super) camera: String,
    /// The ID of the latest report: its `ETag` without the quotes.
    #[schema(example = "1763717400412345")]
    id: String,
    /// Time at which the frame of that report arrived (RFC 3339).
    #[schema(format = DateTime, example = "2025-11-21T09:30:00.412Z")]
    received_at: String,
    /// Age of the report in seconds.
    #[schema(minimum = 0, example = 0.731)]
    age_seconds: f64,
    /// Number of persons there now: what reference counts teach, else those whom the counts follow
    /// while their number is known, else the median of the reports of the last 5 s; `null` while
    /// the camera is paused.
    #[schema(example = 3)]
    persons: Option<usize>,
    /// In 90 % of frames, the true number is at least this one.
    #[schema(example = 2)]
    persons_low: Option<usize>,
    /// In 90 % of frames, the true number is at most this one.
    #[schema(example = 5)]
    persons_high: Option<usize>,
    /// The origin of `persons`: `taught`, `tracks`, `median` or `paused`.
    #[schema(example = "median")]
    persons_source: &'static str,
    /// Number of persons in the latest report.
    #[schema(example = 4)]
    frame_persons: usize,
}

impl CameraRow {
    /// Returns the values that change with a report or a number, not with time.
    pub(super) fn state(&self) -> (&str, &str, [Option<usize>; 3], &'static str) {
        let numbers = [self.persons, self.persons_low, self.persons_high];
        (&self.camera, &self.id, numbers, self.persons_source)
    }

    pub(super) fn at(latest: &StoredReport, headline: Headline, now: Timestamp) -> Self {
        let age = now.duration_since(latest.id.time()).as_secs_f64();
        Self {
            camera: latest.report.camera.clone(),
            id: latest.id.to_string(),
            received_at: format!("{:.3}", latest.report.received_at),
            // The clock may have been set back since.
            age_seconds: (age.max(0.0) * 1000.0).round() / 1000.0,
            persons: headline.number.map(|number| number.persons),
            persons_low: headline.number.map(|number| number.low),
            persons_high: headline.number.map(|number| number.high),
            persons_source: headline.source.into(),
            frame_persons: latest.report.persons,
        }
    }
}
