//! `POST /detect`: detects the persons in one frame.

use axum::{
    Extension,
    extract::State,
    http::{HeaderName, HeaderValue, header::CONTENT_TYPE},
    response::{AppendHeaders, IntoResponse},
};

use super::{
    ApiState,
    answer::AnswerOptions,
    openapi::{DetectForm, DetectQuery, RawBytes},
    parameters::pairs,
    problem::Problem,
    report::{Report, ReportTimings},
    run_detection::{DetectionOutcome, run_detection},
    upload::Upload,
};
use crate::{
    pipeline::{DetectJob, DetectParameters, DetectionReport},
    telemetry::RequestTrace,
};

pub(super) const SERVER_TIMING: HeaderName = HeaderName::from_static("server-timing");
pub(super) const QUEUE_TIME: HeaderName = HeaderName::from_static("x-queue-time");
pub(super) const INFERENCE_TIME: HeaderName = HeaderName::from_static("x-inference-time");
pub(super) const TOTAL_TIME: HeaderName = HeaderName::from_static("x-total-time");
pub(super) const PERSON_COUNT: HeaderName = HeaderName::from_static("x-person-count");

/// Detect persons
///
/// Send the frame as the form field `img` with parameters as further fields, or as the body with
/// parameters in the query. JPEG, PNG and WebP are accepted, whatever the content type. Without
/// `calibration`, the lens circle is detected in the frame, and an ideal 180° equidistant lens that
/// points straight down is assumed.
///
/// The response is the report as JSON. `format` or `Accept` selects the annotated image or a file
/// for annotation tools instead.
#[utoipa::path(
    post, path = "/detect", tag = "detection", operation_id = "detect_persons",
    params(DetectQuery),
    request_body(
        description = "The frame: a form, or the file alone (JPEG, PNG or WebP, with any other content type).",
        content(
            (DetectForm = "multipart/form-data"),
            (inline(RawBytes) = "application/octet-stream"),
        )
    ),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "The persons found, possibly none.",
         content(
            (Report = "application/json"),
            ("image/jpeg"), ("image/png"),
            (Object = "application/geo+json"), (Object = "application/x.coco+json"),
            (String = "application/xml"), (String = "text/plain"),
         ),
         headers(
            ("X-Person-Count" = u64, description = "The number of detected persons."),
            ("X-Request-Id" = String, description = "The ID of the request, or a generated one."),
            ("Server-Timing" = String, description = "The stages, milliseconds."),
            ("X-Queue-Time" = f64, description = "Time that views waited for the model, milliseconds."),
            ("X-Inference-Time" = f64, description = "Time that the model ran, milliseconds."),
            ("X-Total-Time" = f64, description = "Time from the arrival of the frame to its report, milliseconds."),
         )),
    )
)]
pub(super) async fn detect_persons(
    State(state): State<ApiState>,
    Extension(trace): Extension<RequestTrace>,
    upload: Upload,
) -> Result<impl IntoResponse, Problem> {
    let deadline = upload.deadline;
    trace.stage("upload", deadline.began().into_std(), upload.arrived);
    let (job, answer) = job(upload)?;
    let write = move |found: DetectionOutcome<'_>| answer.content(found.detected, found.json);
    let (report, content) = run_detection(&state, &trace, deadline, job, write).await?;
    let media_type = [(CONTENT_TYPE, HeaderValue::from_static(content.media_type))];
    Ok((AppendHeaders(facts(&report)), media_type, content.bytes))
}

/// Returns the headers about a report: the number of persons and the times of the stages.
pub(super) fn facts(report: &DetectionReport) -> [(HeaderName, HeaderValue); 5] {
    let [stages, queue, inference, total] = timing_headers(&ReportTimings::from(&report.timings));
    let count = (PERSON_COUNT, HeaderValue::from(report.persons.len()));
    [stages, queue, inference, total, count]
}

fn job(mut upload: Upload) -> Result<(DetectJob, AnswerOptions), Problem> {
    let parameters = &mut upload.parameters;
    let answer = AnswerOptions::take_from(parameters, &upload.headers, upload.file_name.take())?;
    let parameters = DetectParameters::parse(pairs(parameters))?;
    let mut job = upload.job(parameters)?;
    job.ticket.drawn_width = answer.drawn_width();
    Ok((job, answer))
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
