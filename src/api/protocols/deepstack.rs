//! The DeepStack API, for clients such as Home Assistant and Blue Iris. Requests and responses
//! follow DeepStack's server (Go, `server/server.go`) and its clients `deepstack-python` and
//! `deepstack-sdk`.
//!
//! Failures in the form that DeepStack's clients expect: 400 for any fault of the frame or of a
//! field, 500 for a deadline that has passed, and `success: false` in the body. Statuses without a
//! counterpart in DeepStack (429, 503) stay, because they come with `Retry-After`.
//!
//! The form that DeepStack's clients send: the frame in `image`, `min_confidence` and `api_key`.
//! The query may have the parameters of `POST /detect`.

use std::sync::Arc;

use axum::{
    Json, Router,
    extract::{FromRequest, Path, Request, State},
    http::{Method, StatusCode, Uri},
    middleware::map_response,
    response::Response,
    routing::any,
};
use lookdown_calibration::CalibrationId;
use lookdown_common::report::{Report, ReportPerson};
use lookdown_detect::{
    parameters::{DetectParameters, ParameterError},
    pipeline::DetectJob,
};
use serde::Serialize;
use tower_http::catch_panic::CatchPanicLayer;
use utoipa::ToSchema;

use crate::{
    access::Scope,
    api::{
        ApiState,
        detect::{
            run::{detect_parameters, run_detection},
            upload::{FieldUse, Upload, is_multipart},
        },
        http::{
            access,
            context::RequestContext,
            envelope,
            problem::{Problem, ProblemKind},
            query::query_parameters,
        },
        openapi::{CalibratedDetectionQuery, DetectionQuery},
        require_scope::RequireRead,
    },
    calibration_store::CalibrationRow,
};

/// Detect persons (DeepStack)
///
/// Without a calibration, the lens circle is detected in the frame. An ideal 180° equidistant lens
/// that points straight down is assumed. Unknown fields are ignored. The query may have the
/// parameters of `POST /detect`, such as `profile` and `camera`; unknown ones are refused.
#[utoipa::path(
    post, path = "/v1/vision/detection", tag = "deepstack", operation_id = "detect_as_deepstack",
    params(DetectionQuery),
    request_body(content = DeepStackForm, content_type = "multipart/form-data"),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "The persons found, possibly none.", body = DeepStackAnswer),
    )
)]
pub(in crate::api) async fn detect_as_deepstack(
    State(state): State<ApiState>,
    upload: DeepStackUpload,
) -> Result<Json<DeepStackAnswer>, Problem> {
    answer(&state, upload, None).await
}

/// Detect persons with a calibration (DeepStack)
///
/// The calibration ID replaces the name of DeepStack's custom model.
#[utoipa::path(
    post, path = "/v1/vision/custom/{calibration}", tag = "deepstack",
    operation_id = "detect_as_deepstack_with",
    params(
        ("calibration" = String, Path, description = "The calibration's ID."),
        CalibratedDetectionQuery,
    ),
    request_body(content = DeepStackForm, content_type = "multipart/form-data"),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "The persons found, possibly none.", body = DeepStackAnswer),
    )
)]
pub(in crate::api) async fn detect_as_deepstack_with(
    State(state): State<ApiState>,
    Path(calibration): Path<String>,
    upload: DeepStackUpload,
) -> Result<Json<DeepStackAnswer>, Problem> {
    // A name that is not a valid ID is reported as an unknown model.
    let calibration: CalibrationId = calibration
        .parse()
        .map_err(|error| Problem::new(ProblemKind::UnknownCalibration, format!("{error}")))?;
    answer(&state, upload, Some(calibration)).await
}

async fn answer(
    state: &ApiState,
    sent: DeepStackUpload,
    calibration: Option<CalibrationId>,
) -> Result<Json<DeepStackAnswer>, Problem> {
    let context = Arc::clone(&sent.upload.context);
    context.note_upload(sent.upload.arrived);
    let job = sent.job(state, calibration.as_ref().map(CalibrationId::as_str))?;
    let answered = run_detection(state, &context, job, |found| {
        Ok(DeepStackAnswer::from(found.report))
    });
    Ok(Json(answered.await?.answer))
}

/// List calibrations (DeepStack)
///
/// The original DeepStack has no such route. Its successors have it, and Blue Iris calls it.
#[utoipa::path(
    post, path = "/v1/vision/custom/list", tag = "deepstack", operation_id = "list_as_deepstack",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses(
        (status = OK, description = "The IDs of the calibrations in use.", body = DeepStackModels),
    )
)]
pub(in crate::api) async fn list_as_deepstack(
    State(state): State<ApiState>,
    _reader: RequireRead,
) -> Json<DeepStackModels> {
    Json(state.calibrations.rows().into_iter().collect())
}

/// Get the calibrations (DeepStack)
///
/// The same as with `POST`, for clients of CodeProject.AI.
#[utoipa::path(
    get, path = "/v1/vision/custom/list", tag = "deepstack", operation_id = "get_list_as_deepstack",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses(
        (status = OK, description = "The IDs of the calibrations in use.", body = DeepStackModels),
    )
)]
pub(in crate::api) async fn get_list_as_deepstack(
    state: State<ApiState>,
    reader: RequireRead,
) -> Json<DeepStackModels> {
    list_as_deepstack(state, reader).await
}

/// Paths of DeepStack without a route here.
const OTHER_PATHS: &str = "/v1/vision/{*path}";

/// Adds the response layer to the routes of DeepStack, and to the paths below them that have no
/// route.
pub(in crate::api) fn with_failures(routes: Router<ApiState>) -> Router<ApiState> {
    let not_found = any(async || StatusCode::NOT_FOUND);
    routes
        .route(OTHER_PATHS, not_found)
        .layer(CatchPanicLayer::custom(envelope::panic_response))
        .layer(map_response(as_deepstack))
}

/// Changes the problem of a failed response.
async fn as_deepstack(method: Method, uri: Uri, mut response: Response) -> Response {
    if let Some(problem) = Problem::take_from(&mut response, method.as_str(), uri.path()) {
        let status = status_of(problem.kind);
        let problem = problem.with_status(status).with_member("success", false);
        *response.status_mut() = status;
        response.extensions_mut().insert(problem);
    }
    response
}

/// The status that DeepStack has for a kind of problem.
fn status_of(kind: ProblemKind) -> StatusCode {
    match kind {
        ProblemKind::ImageTooLarge => StatusCode::BAD_REQUEST,
        ProblemKind::Timeout => StatusCode::INTERNAL_SERVER_ERROR,
        kind => match kind.entry().status {
            StatusCode::UNSUPPORTED_MEDIA_TYPE | StatusCode::UNPROCESSABLE_ENTITY => {
                StatusCode::BAD_REQUEST
            }
            status => status,
        },
    }
}

const MIN_CONFIDENCE: &str = "min_confidence";
const API_KEY: &str = "api_key";
/// The default of DeepStack's server.
const DEFAULT_MIN_CONFIDENCE: &str = "0.4";
/// The name of `min_confidence` in this API.
const SCORE_THRESHOLD: &str = DetectParameters::SCORE_THRESHOLD;

/// A frame in DeepStack's form.
#[derive(ToSchema)]
#[expect(dead_code, reason = "documents the form that is parsed below")]
struct DeepStackForm {
    /// The frame: a JPEG, PNG or WebP file.
    #[schema(value_type = String, format = Binary, content_media_type = "application/octet-stream")]
    image: Vec<u8>,
    /// Least confidence; persons with a lower one are omitted.
    #[schema(nullable = false, minimum = 0, maximum = 1, default = 0.4)]
    min_confidence: Option<f64>,
    /// An API key with the scope `detect`, for clients that cannot send it in a header. Empty for
    /// none.
    #[schema(nullable = false)]
    api_key: Option<String>,
}

/// A frame in DeepStack's form, whose key has been checked.
pub(in crate::api) struct DeepStackUpload {
    upload: Upload,
    /// The parameters of the query, by name. Neither names nor values are checked.
    query: Vec<(String, String)>,
}

impl FromRequest<ApiState> for DeepStackUpload {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &ApiState) -> Result<Self, Problem> {
        let known = &state.options.access;
        let headers = request.headers();
        let is_form = is_multipart(headers);
        // A key in a header is checked before the body is read. Other keys are in the form. That
        // form is read within a small memory budget of its own, so clients without a key cannot use
        // up the memory of the others.
        let mut budget = &state.uploads;
        if !is_form || access::shows_key(headers) {
            let context = RequestContext::from_extensions(request.extensions())?;
            known.check(headers, context.holder.as_ref(), None, Scope::Detect)?;
        } else if known.needs_keys() {
            budget = &state.unauthenticated_uploads;
        }
        if !is_form {
            return Err(no_form());
        }
        let query = query_parameters(request.uri())?;
        let mut upload = Upload::receive(request, state, budget, use_of).await?;
        let mut keys = upload
            .form
            .parameters
            .extract_if(.., |(name, _)| name == API_KEY);
        // Clients without a key send an empty field.
        let key = keys.next().filter(|(_, key)| !key.is_empty());
        if keys.next().is_some() {
            return Err(ParameterError::repeated(API_KEY).into());
        }
        drop(keys);
        let key = key.as_ref().map(|(_, key)| key.as_str());
        let holder = upload.context.holder.as_ref();
        let holder = known.check(&upload.headers, holder, key, Scope::Detect)?;
        upload.caller = upload.caller.with_holder(known, holder.as_ref());
        Ok(Self { upload, query })
    }
}

#[expect(
    clippy::unnecessary_wraps,
    reason = "other forms refuse unknown fields"
)]
fn use_of(name: &str) -> Result<FieldUse, Problem> {
    Ok(match name {
        "image" => FieldUse::Frame,
        MIN_CONFIDENCE | API_KEY => FieldUse::Parameter,
        // DeepStack ignores unknown fields, and its clients rely on that.
        _ => FieldUse::None,
    })
}

fn no_form() -> Problem {
    let fault = "send the frame in a form (multipart/form-data), as in curl -F \
                 image=@frame.jpg";
    Problem::for_parameter(ProblemKind::MissingImage, "image", fault)
}

impl DeepStackUpload {
    /// Returns the detection job of this form. `calibration` is that of the path.
    fn job(self, state: &ApiState, calibration: Option<&str>) -> Result<DetectJob, Problem> {
        let Self { upload, query } = self;
        let query = query.iter();
        let mut given: Vec<_> = query.map(|(name, value)| (&**name, &**value)).collect();
        given.extend(calibration.map(|id| (DetectParameters::CALIBRATION, id)));
        let is_in_query = given.iter().any(|(name, _)| *name == SCORE_THRESHOLD);
        // All remaining fields have this name. Clients without a threshold send an empty field.
        let confidences = upload.form.parameters.iter().map(|(_, value)| &**value);
        let confidences = confidences.filter(|value| !value.is_empty());
        given.extend(confidences.map(|value| (SCORE_THRESHOLD, value)));
        let protocol = [(SCORE_THRESHOLD, DEFAULT_MIN_CONFIDENCE)];
        let parameters =
            detect_parameters(state, given, &protocol).map_err(|error| match &*error.name {
                SCORE_THRESHOLD if !is_in_query => renamed(error),
                _ => error,
            })?;
        upload.job(parameters)
    }
}

/// Replaces the parameter name in an error by the name that the client sent.
fn renamed(error: ParameterError) -> ParameterError {
    ParameterError {
        name: MIN_CONFIDENCE.to_owned(),
        ..error
    }
}

/// The responses that DeepStack's clients read.
const LABEL: &str = "person";
const MILLIS_PER_SECOND: f64 = 1000.0;

/// The persons in one frame, in DeepStack's format.
#[derive(Debug, Serialize, ToSchema)]
#[schema(example = json!({
    "success": true,
    "predictions": [{
        "label": "person", "confidence": 0.8731,
        "x_min": 1102, "y_min": 700, "x_max": 1342, "y_max": 843
    }],
    "duration": 0.614,
    "message": "Found person",
    "count": 1,
    "code": 200,
    "command": "detect",
    "moduleId": "Lookdown",
    "inferenceMs": 581,
    "processMs": 614,
    "analysisRoundTripMs": 614
}))]
#[serde(rename_all = "camelCase")]
pub(in crate::api) struct DeepStackAnswer {
    /// Always true; failures have false.
    success: bool,
    /// Persons, highest confidence first.
    predictions: Vec<DeepStackPrediction>,
    /// Time from the arrival of the frame to its report, seconds.
    duration: f64,
    /// The result in words, of CodeProject.AI as the fields below.
    message: &'static str,
    /// The number of persons.
    count: usize,
    /// Always 200.
    code: u16,
    /// Always `detect`.
    command: &'static str,
    /// Always `Lookdown`.
    module_id: &'static str,
    /// Time of the inference, whole milliseconds.
    inference_ms: i64,
    /// Time from the arrival of the frame to its report, whole milliseconds.
    process_ms: i64,
    /// The same as `processMs`: no other process is involved.
    analysis_round_trip_ms: i64,
}

/// A person.
#[derive(Debug, PartialEq, Serialize, ToSchema)]
pub(in crate::api) struct DeepStackPrediction {
    /// Always `person`.
    label: &'static str,
    /// The score, 0 to 1.
    confidence: f64,
    /// Left edge, pixels of the frame.
    x_min: i64,
    /// Top edge.
    y_min: i64,
    /// Right edge.
    x_max: i64,
    /// Bottom edge.
    y_max: i64,
}

impl From<&Report> for DeepStackAnswer {
    fn from(report: &Report) -> Self {
        let total_ms = whole(report.timings_ms.total.round());
        Self {
            success: true,
            predictions: report.persons.iter().map(Into::into).collect(),
            duration: report.timings_ms.total / MILLIS_PER_SECOND,
            message: match report.persons.len() {
                0 => "No objects found",
                _ => "Found person",
            },
            count: report.persons.len(),
            code: 200,
            command: "detect",
            module_id: "Lookdown",
            inference_ms: whole(report.timings_ms.inference.round()),
            process_ms: total_ms,
            analysis_round_trip_ms: total_ms,
        }
    }
}

impl From<&ReportPerson> for DeepStackPrediction {
    /// These clients expect whole pixels. The box is rounded outwards, within the frame.
    fn from(person: &ReportPerson) -> Self {
        let bbox = &person.bbox;
        Self {
            label: LABEL,
            confidence: person.score,
            x_min: whole(bbox.x_min.floor()),
            y_min: whole(bbox.y_min.floor()),
            x_max: whole(bbox.x_max.ceil()),
            y_max: whole(bbox.y_max.ceil()),
        }
    }
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "boxes lie within the frame, and times within deadlines"
)]
fn whole(number: f64) -> i64 {
    number as i64
}

/// The calibrations, in place of custom models.
#[derive(Debug, Serialize, ToSchema)]
pub(in crate::api) struct DeepStackModels {
    /// Always true; failures have false.
    success: bool,
    /// The IDs of the calibrations in use.
    models: Vec<String>,
}

impl FromIterator<CalibrationRow> for DeepStackModels {
    fn from_iter<T: IntoIterator<Item = CalibrationRow>>(rows: T) -> Self {
        let serving = rows.into_iter().filter(|row| row.entry.is_some());
        Self {
            success: true,
            models: serving.map(|row| row.id.to_string()).collect(),
        }
    }
}

/// A server that responds.
#[derive(Debug, Serialize, ToSchema)]
pub(in crate::api) struct Pong {
    /// Always true.
    success: bool,
}

/// Newer versions of the server.
#[derive(Debug, Serialize, ToSchema)]
#[serde(rename_all = "camelCase")]
pub(in crate::api) struct VersionStatus {
    /// Always true.
    success: bool,
    /// An explanation.
    message: &'static str,
    /// Always false: the server looks for no updates.
    update_available: bool,
    /// The version that runs.
    version: VersionNumbers,
    /// The version that runs.
    current: VersionNumbers,
    /// The version that runs: no newer one is known.
    latest: VersionNumbers,
}

/// A version.
#[derive(Debug, Serialize, ToSchema)]
#[serde(rename_all = "camelCase")]
struct VersionNumbers {
    /// The first number.
    major: u32,
    /// The second number.
    minor: u32,
    /// The third number.
    patch: u32,
    /// The name of a version before a release; empty for a release.
    pre_release: &'static str,
    /// Always 0.
    build: u32,
    /// Always false.
    security_update: bool,
    /// Always empty.
    file: &'static str,
    /// Always empty.
    release_notes: &'static str,
}

impl VersionNumbers {
    /// The version that runs.
    fn current() -> Self {
        // Cargo writes numbers.
        let number = |text: &str| text.parse().unwrap_or_default();
        Self {
            major: number(env!("CARGO_PKG_VERSION_MAJOR")),
            minor: number(env!("CARGO_PKG_VERSION_MINOR")),
            patch: number(env!("CARGO_PKG_VERSION_PATCH")),
            pre_release: env!("CARGO_PKG_VERSION_PRE"),
            build: 0,
            security_update: false,
            file: "",
            release_notes: "",
        }
    }
}

/// Ping the server (CodeProject.AI)
#[utoipa::path(
    get, path = "/v1/status/ping", tag = "operation", operation_id = "ping_as_code_project_ai",
    security(()),
    responses((status = OK, description = "The server responds.", body = Pong))
)]
pub(in crate::api) async fn ping() -> Json<Pong> {
    Json(Pong { success: true })
}

/// Ping the server (CodeProject.AI 2)
#[utoipa::path(
    get, path = "/v1/server/status/ping", tag = "operation",
    operation_id = "ping_server_as_code_project_ai",
    security(()),
    responses((status = OK, description = "The server responds.", body = Pong))
)]
pub(in crate::api) async fn server_ping() -> Json<Pong> {
    ping().await
}

/// Get the version (CodeProject.AI)
///
/// Lookdown opens no connection to look for updates, so none is ever reported.
#[utoipa::path(
    get, path = "/v1/status/updateavailable", tag = "operation",
    operation_id = "get_update_as_code_project_ai",
    security(()),
    responses((status = OK, description = "The version that runs.", body = VersionStatus))
)]
pub(in crate::api) async fn update_available() -> Json<VersionStatus> {
    Json(VersionStatus {
        success: true,
        message: "Lookdown does not look for updates.",
        update_available: false,
        version: VersionNumbers::current(),
        current: VersionNumbers::current(),
        latest: VersionNumbers::current(),
    })
}
