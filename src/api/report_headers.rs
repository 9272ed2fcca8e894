//! The headers of a response about its report: the number of persons and the times of the stages.

use axum::http::{HeaderName, HeaderValue};

use super::report::ReportTimings;
use crate::pipeline::DetectionReport;

pub(super) const SERVER_TIMING: HeaderName = HeaderName::from_static("server-timing");
pub(super) const QUEUE_TIME: HeaderName = HeaderName::from_static("x-queue-time");
pub(super) const INFERENCE_TIME: HeaderName = HeaderName::from_static("x-inference-time");
pub(super) const TOTAL_TIME: HeaderName = HeaderName::from_static("x-total-time");
pub(super) const PERSON_COUNT: HeaderName = HeaderName::from_static("x-person-count");

/// Returns the headers about a report: the number of persons and the times of the stages.
pub(super) fn report_headers(report: &DetectionReport) -> [(HeaderName, HeaderValue); 5] {
    let [stages, queue, inference, total] = timing_headers(&ReportTimings::from(&report.timings));
    let count = (PERSON_COUNT, HeaderValue::from(report.persons.len()));
    [stages, queue, inference, total, count]
}

/// Returns the stages as `Server-Timing: decode;dur=3.1, …, total;dur=412.0` (W3C), and the stages
/// that measure the load as plain numbers; all in milliseconds.
fn timing_headers(timings: &ReportTimings) -> [(HeaderName, HeaderValue); 4] {
    let stages = timings
        .stages()
        .map(|(stage, millis)| format!("{stage};dur={millis}"));
    [
        (SERVER_TIMING, stages.join(", ")),
        (QUEUE_TIME, timings.queue.to_string()),
        (INFERENCE_TIME, timings.inference.to_string()),
        (TOTAL_TIME, timings.total.to_string()),
    ]
    // Names and numbers are visible ASCII.
    .map(|(name, text)| (name, text.parse().unwrap_or(HeaderValue::from_static(""))))
}
