//! One frame in, its persons out.

use std::time::Instant;

use axum::{
    Extension,
    extract::State,
    http::{HeaderName, HeaderValue, header::CONTENT_TYPE},
    response::{AppendHeaders, IntoResponse},
};
use bytes::Bytes;
use tokio::time::timeout_at;

use super::{
    ApiState,
    answer::{AnswerOptions, Content},
    deadline::Deadline,
    openapi::{DetectForm, DetectProblems, DetectQuery},
    problem::{Problem, ProblemKind},
    report::{Report, ReportTimings},
    request_id::RequestId,
    upload::Upload,
};
use crate::{
    metrics::Metrics,
    pipeline::{DetectJob, DetectParameters, Detected, DetectionReport, Ticket},
    results::NewReport,
    telemetry::RequestTrace,
};

/// `C_t` of requests that name none.
const DEFAULT_SCORE_THRESHOLD: f64 = 0.3;
pub(super) const SERVER_TIMING: HeaderName = HeaderName::from_static("server-timing");
pub(super) const QUEUE_TIME: HeaderName = HeaderName::from_static("x-queue-time");
pub(super) const INFERENCE_TIME: HeaderName = HeaderName::from_static("x-inference-time");
pub(super) const TOTAL_TIME: HeaderName = HeaderName::from_static("x-total-time");
pub(super) const PERSON_COUNT: HeaderName = HeaderName::from_static("x-person-count");

/// Find the persons in a frame.
///
/// Send the frame as the form field `img` with parameters as further fields, or as the body with
/// parameters in the query. JPEG, PNG and WebP are read, whatever the content type says. Without
/// `calibration` the lens circle is found in the frame and an ideal 180° equidistant lens that
/// looks straight down is assumed.
///
/// The answer is the report as JSON unless `format` or `Accept` asks for another: the frame with boxes
/// drawn into it, or a file for annotation tools.
#[utoipa::path(
    post, path = "/detect", tag = "detection", operation_id = "detect_persons",
    params(DetectQuery),
    request_body(
        description = "The frame.",
        content(
            (DetectForm = "multipart/form-data"),
            ("image/jpeg"), ("image/png"), ("image/webp"), ("application/octet-stream"),
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
            ("X-Person-Count" = u64, description = "How many persons were found."),
            ("X-Request-Id" = String, description = "The request's own, or a new one."),
            ("Server-Timing" = String, description = "The stages, milliseconds."),
            ("X-Queue-Time" = f64, description = "How long views waited for the network, milliseconds."),
            ("X-Inference-Time" = f64, description = "How long the network ran, milliseconds."),
            ("X-Total-Time" = f64, description = "From the frame's arrival to its report, milliseconds."),
         )),
        DetectProblems,
    )
)]
pub(super) async fn detect_persons(
    State(state): State<ApiState>,
    Extension(request_id): Extension<RequestId>,
    Extension(trace): Extension<RequestTrace>,
    upload: Upload,
) -> Result<impl IntoResponse, Problem> {
    let server_limit = upload.deadline;
    trace.stage("upload", server_limit.began().into_std(), upload.arrived);
    let (job, answer) = job(upload, &request_id)?;
    let own_limit = job.parameters.timeout;
    let limit = own_limit.map_or(server_limit, |own| server_limit.within(own));
    let timeline = job.ticket.timeline.clone();
    let work = state.workers.detect_and(job, |detected| {
        // The frame is kept for as long as the answer needs it, which a report does not.
        let report = detected.report.clone();
        (report, written(detected, answer))
    });
    let outcome = timeout_at(limit.at(), work).await;
    for span in timeline.spans(Instant::now()) {
        trace.stage(span.stage.name(), span.began, span.ended);
    }
    let (report, written) =
        outcome.map_err(|_| timed_out(limit, limit.at() < server_limit.at()))??;
    describe(&trace, &report);
    record(&state.metrics, &report);
    if state.options.zone_metrics {
        let zones = report.zones.iter();
        let zones = zones.map(|zone| (zone.name.as_str(), zone.persons));
        state.metrics.show_zones(&report.calibration.id, zones);
    }
    let (json, content) = written?;
    let timings = timing_headers(&ReportTimings::from(&report.timings));
    let persons = report.persons.len();
    let kept = NewReport {
        camera: report.camera,
        received_at: report.received_at,
        persons,
        json,
    };
    state.results.publish(kept).await;
    let facts = [
        (PERSON_COUNT, HeaderValue::from(persons)),
        (CONTENT_TYPE, HeaderValue::from_static(content.media_type)),
    ];
    Ok((AppendHeaders(timings), facts, content.bytes))
}

/// The report as it is kept, and what its sender is answered.
fn written(detected: Detected, answer: AnswerOptions) -> Result<(Bytes, Content), Problem> {
    let json = serde_json::to_vec(&Report::from(&detected.report)).map_err(Problem::internal)?;
    let json = Bytes::from(json);
    let content = answer.content(detected, &json)?;
    Ok((json, content))
}

fn job(mut upload: Upload, request_id: &RequestId) -> Result<(DetectJob, AnswerOptions), Problem> {
    let parameters = &mut upload.parameters;
    let answer = AnswerOptions::take_from(parameters, &upload.headers, upload.file_name)?;
    let pairs = parameters.iter();
    let pairs = pairs.map(|(name, value)| (name.as_str(), value.as_str()));
    let parameters = DetectParameters::parse(pairs, DEFAULT_SCORE_THRESHOLD)?;
    let job = DetectJob {
        ticket: Ticket::of(parameters.priority),
        parameters,
        request_id: request_id.as_str().to_owned(),
        received_at: upload.received_at,
        arrived: upload.arrived,
        image: upload.image,
        calibration: None,
    };
    Ok((job, answer))
}

fn timed_out(limit: Deadline, is_its_own: bool) -> Problem {
    let seconds = limit.limit_seconds();
    let whose = if is_its_own {
        "timeout_millis"
    } else {
        "server.request_timeout_millis"
    };
    let detail = format!(
        "the frame had no report within {seconds} s: use a faster profile, send fewer frames at \
         a time, or raise {whose}"
    );
    Problem::new(ProblemKind::Timeout, detail)
}

/// What may explain how long a frame took.
fn describe(trace: &RequestTrace, report: &DetectionReport) {
    trace.note("lookdown.camera", report.camera.clone());
    trace.note("lookdown.calibration", report.calibration.id.clone());
    trace.note("lookdown.model", report.model.name.clone());
    trace.note("lookdown.profile", report.profile.name());
    for (key, count) in [
        ("lookdown.views", report.views.inferred),
        ("lookdown.batches", report.batch_count),
        ("lookdown.persons", report.persons.len()),
    ] {
        trace.note(key, i64::try_from(count).unwrap_or(i64::MAX));
    }
}

fn record(metrics: &Metrics, report: &DetectionReport) {
    let labels = [report.model.name.as_str(), report.profile.name()];
    let timings = &report.timings;
    for (histogram, span) in [
        (&metrics.request_duration, timings.total),
        (&metrics.queue_duration, timings.queue),
        (
            &metrics.compute_input_duration,
            timings.decode + timings.calibrate + timings.remap,
        ),
        (&metrics.compute_infer_duration, timings.inference),
        (&metrics.compute_output_duration, timings.refine),
    ] {
        histogram
            .with_label_values(&labels)
            .observe(span.as_secs_f64());
    }
    metrics.views.inc_by(report.views.inferred as u64);
    metrics
        .unchanged_views
        .inc_by(report.views.unchanged as u64);
    metrics.batches.inc_by(report.batch_count as u64);
    metrics.non_finite.inc_by(report.non_finite as u64);
    metrics.persons.inc_by(report.persons.len() as u64);
}

/// The stages as `Server-Timing: decode;dur=3.1, …, total;dur=412.0` (W3C), and those that say how
/// busy the server is as plain numbers; all in milliseconds.
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
