//! The headers of a response about its report: the number of persons and the times of the stages.

use axum::http::{HeaderName, HeaderValue};
use lookdown_detect::pipeline::DetectionReport;

use super::report::to_timings;

pub(in crate::api) const SERVER_TIMING: HeaderName = HeaderName::from_static("server-timing");
pub(in crate::api) const PERSON_COUNT: HeaderName = HeaderName::from_static("x-person-count");

/// Returns the headers about a report: the number of persons, and the stages as
/// `Server-Timing: decode;dur=3.1, …, total;dur=412.0` (W3C), milliseconds.
pub(in crate::api) fn report_headers(report: &DetectionReport) -> [(HeaderName, HeaderValue); 2] {
    let timings = to_timings(&report.timings);
    let stages = timings
        .stages()
        .map(|(stage, millis)| format!("{stage};dur={millis}"));
    // Names and numbers are visible ASCII.
    let stages = stages.join(", ").parse();
    let stages = stages.unwrap_or(HeaderValue::from_static(""));
    let count = HeaderValue::from(report.persons.len());
    [(SERVER_TIMING, stages), (PERSON_COUNT, count)]
}
