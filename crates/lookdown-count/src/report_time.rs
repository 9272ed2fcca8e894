//! The time of a report.

use std::time::Instant;

/// The time of a report.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ReportTime {
    /// Time of its frame, milliseconds since the Unix epoch.
    pub(crate) at_ms: i64,
    /// Longest time between two reports of a camera that is known, milliseconds.
    pub(crate) longest_gap_ms: i64,
    /// Time after which people on the floor are an alert, milliseconds; `None` for no alerts.
    pub(crate) floor_alert_after_ms: Option<i64>,
    /// The bar of the server's number: the true number is in 90 % of frames from the first of these
    /// to the second.
    pub(crate) bar: Option<[u64; 2]>,
    /// Its arrival, by a clock that never jumps.
    pub(crate) now: Instant,
}
