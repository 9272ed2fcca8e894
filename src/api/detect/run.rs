//! Detection for all routes: waits for the report until the deadline, and counts, traces and stores
//! it.

use std::time::{Duration, Instant};

use bytes::Bytes;
use lookdown_calibration::CalibrationId;
use lookdown_common::report::Report;
use lookdown_detect::{
    parameters::{DefaultSource, DetectParameters, ParameterError},
    pipeline::{DetectJob, DetectedFrame, DetectionReport, PipelineError, Timeline},
};
use lookdown_imaging::annotate::Concealment;

use super::report::to_report;
use crate::{
    annotated_image::StoredFrame,
    api::{
        ApiState,
        http::{
            context::RequestContext,
            problem::{Problem, ProblemKind},
        },
    },
    metrics::Metrics,
    results::NewReport,
    telemetry::RequestTrace,
};

/// The input of a response.
pub(in crate::api) struct AnswerInput<'a> {
    /// The frame and its detections.
    pub(in crate::api) frame: DetectedFrame,
    /// The report.
    pub(in crate::api) report: &'a Report,
    /// The report as stored JSON.
    pub(in crate::api) json: &'a Bytes,
}

/// An answered request.
pub(in crate::api) struct Answered<T> {
    /// The report.
    pub(in crate::api) report: DetectionReport,
    /// The response of the writer.
    pub(in crate::api) answer: T,
}

/// Detects the persons in a frame. `write` builds the response while the frame still holds its
/// permit.
pub(in crate::api) async fn run_detection<T: Send + 'static>(
    state: &ApiState,
    context: &RequestContext,
    job: DetectJob,
    write: impl FnOnce(AnswerInput<'_>) -> Result<T, Problem> + Send + 'static,
) -> Result<Answered<T>, Problem> {
    require_other_camera(state, context, &job.parameters)?;
    let timeout = job.parameters.timeout;
    let timeline = job.ticket.timeline.clone();
    let is_stored = job.parameters.store;
    let concealment = state.options.settings.results.conceal_images;
    let observer = state.clone();
    let frame = job.image.clone();
    let work = state.workers.detect_and(job, move |detected| {
        if is_stored {
            observer.suggestions.observe(&detected, Instant::now());
            let views = &observer.options.views;
            views.detected(&frame, &detected);
        }
        // Drawing needs the frame after the report has been taken.
        let report = detected.report.clone();
        let is_kept = is_stored && observer.keeps_image(&report.camera);
        let image = is_kept.then(|| new_image(&detected, concealment)).flatten();
        (report, image, written(detected, write))
    });
    let (report, image, written) = wait_for_workers(context, timeout, &timeline, work).await?;
    describe(&context.trace, &report);
    record(&state.metrics, &report);
    let (json, answer) = written?;
    if is_stored {
        let kept = NewReport {
            camera: report.camera.clone(),
            received_at: report.received_at,
            persons: report.persons.len(),
            scores: Some(report.scores.clone()),
            json,
        };
        state.results.publish(kept, image);
        record_zones(state, &report);
    }
    Ok(Answered { report, answer })
}

/// Refuses a frame that would replace the results of a camera of this process.
fn require_other_camera(
    state: &ApiState,
    context: &RequestContext,
    parameters: &DetectParameters,
) -> Result<(), Problem> {
    let of_calibration = parameters.calibration.as_ref().map(CalibrationId::as_str);
    let camera = parameters.camera.as_deref().or(of_calibration);
    let own = state.options.companions.own_cameras();
    let Some(camera) = camera.filter(|camera| own.contains(camera)) else {
        return Ok(());
    };
    if context.is_own || !parameters.store {
        return Ok(());
    }
    let detail = format!(
        "camera: {camera:?} is a camera that this server reads itself: give another name, or \
         store=false"
    );
    Err(Problem::new(ProblemKind::Forbidden, detail).with_parameter("camera"))
}

/// Waits for work of the worker threads until the deadline, or until the timeout of the request
/// itself. Adds the stages of the work to the trace.
pub(in crate::api) async fn wait_for_workers<T>(
    context: &RequestContext,
    timeout: Option<Duration>,
    timeline: &Timeline,
    work: impl Future<Output = Result<T, PipelineError>>,
) -> Result<T, Problem> {
    let remedy = "send fewer frames or views at a time, use a faster profile for frames";
    let deadline = context.deadline.within(timeout, "timeout_millis");
    let done = deadline.wait("no result", remedy, work).await;
    for span in timeline.spans(Instant::now()) {
        context
            .trace
            .stage(span.stage.name(), span.began, span.ended);
    }
    done
}

/// Returns the report as stored JSON, and the response of the writer.
fn written<T>(
    detected: DetectedFrame,
    write: impl FnOnce(AnswerInput<'_>) -> Result<T, Problem>,
) -> Result<(Bytes, T), Problem> {
    let report = to_report(&detected.report);
    let json = serde_json::to_vec(&report).map_err(Problem::internal)?;
    let json = Bytes::from(json);
    let answer = write(AnswerInput {
        frame: detected,
        report: &report,
        json: &json,
    })?;
    Ok((json, answer))
}

/// Returns the image to store with the report. A failure here does not fail the request.
fn new_image(detected: &DetectedFrame, concealment: Option<Concealment>) -> Option<StoredFrame> {
    match StoredFrame::new(detected, concealment) {
        Ok(frame) => Some(frame),
        Err(error) => {
            tracing::warn!("the image of this frame is not stored: {error}");
            None
        }
    }
}

/// Adds attributes that may explain the duration to the span.
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

/// Sets the metrics of the camera's zones.
fn record_zones(state: &ApiState, report: &DetectionReport) {
    if state.options.settings.calibrations.zone_metrics {
        let zones = report.zones.iter();
        let zones = zones.map(|zone| (zone.name.as_str(), zone.persons));
        state.metrics.set_zones(&report.camera, zones);
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

/// Checks the parameters of a request. `protocol` has the defaults of the request's protocol, which
/// apply where neither the calibration nor the server has one.
pub(in crate::api) fn detect_parameters<'a>(
    state: &ApiState,
    mut given: Vec<(&'a str, &'a str)>,
    protocol: &[(&'a str, &'a str)],
) -> Result<DetectParameters, ParameterError> {
    let value = |wanted: &str| {
        let mut named = given.iter();
        named.find_map(|(name, value)| (*name == wanted).then_some(*value))
    };
    let entry = |id: &str| state.calibrations.entry(&id.parse::<CalibrationId>().ok()?);
    // An invalid ID is refused below, an unknown one by the engine.
    let calibration = value(DetectParameters::CALIBRATION);
    let mut camera = calibration.and_then(entry);
    if calibration.is_none()
        && let Some(name) = value(DetectParameters::CAMERA)
    {
        // A camera without a calibration uses the calibration of the same name.
        camera = entry(name);
        if camera.is_some() {
            given.push((DetectParameters::CALIBRATION, name));
        }
    }
    let server = &state.options.settings.detect;
    let mut layers = Vec::with_capacity(2);
    if let Some(camera) = &camera {
        layers.push((DefaultSource::Calibration, &camera.defaults));
    }
    layers.push((DefaultSource::Server, server));
    for (name, value) in protocol {
        let is_given = given.iter().any(|(known, _)| known == name);
        if !is_given && !layers.iter().any(|(_, defaults)| defaults.has(name)) {
            given.push((name, value));
        }
    }
    DetectParameters::parse_with(given, &layers)
}
