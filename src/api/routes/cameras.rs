//! The cameras of `lookdown run`: the scope `read` reads them, the scope `admin` changes them.

pub(in crate::api) mod reference_counts;
pub(in crate::api) mod suggestion;
pub(in crate::api) mod views;

use std::{sync::Arc, time::Duration};

use axum::{
    Json,
    extract::{FromRequest, Path, Request, State},
    http::{
        StatusCode,
        header::{CACHE_CONTROL, CONTENT_TYPE},
    },
    response::{IntoResponse, Response},
};
use jiff::Timestamp;
use lookdown_common::{ConfigError, Secret, text::one_line};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use serde_json::{Map, Value};
use tokio::time::{sleep, timeout};
use utoipa::ToSchema;

use super::counts;
use crate::{
    api::{
        ApiState,
        http::{
            context::RequestContext,
            deadline::{CAMERAS, Deadline},
            problem::{Problem, ProblemKind},
        },
        openapi::RawBytes,
        require_scope::{RequireAdmin, RequireRead},
    },
    cameras::{CameraError, Cameras, StoredCamera},
};

use suggestion::SuggestionState;

/// Largest description of a camera.
const MAX_BYTES: usize = 16 << 10;
/// Longest wait for the end of a deleted camera, and the interval of the checks.
const END_TIMEOUT: Duration = Duration::from_secs(10);
const END_CHECK: Duration = Duration::from_millis(100);

/// A camera to add, to change or to test.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "url": "rtsp://10.0.0.8:554/stream2", "user": "viewer", "password": "secret" }))]
pub(in crate::api) struct NewCamera {
    /// The URL of the source: `rtsp`, `rtsps`, `http` or `https`, without user and password.
    /// Without it, the stored URL stays.
    #[serde(default)]
    url: String,
    /// The user name.
    user: Option<String>,
    /// The password. It is never returned. Without it, the stored password of the same user at the
    /// same host stays.
    #[schema(write_only)]
    password: Option<String>,
    /// The interval between two frames, such as `200ms` (default `1s`).
    every: Option<String>,
    /// The ID of the calibration (default: the calibration with the name of the camera, if there is
    /// one).
    calibration: Option<String>,
    /// The profile (default: that of the server).
    profile: Option<String>,
    /// `true` if no frames are read.
    #[serde(default)]
    paused: bool,
    /// `true` if the latest image is kept, as for a camera in the setting `results.images`.
    #[serde(default)]
    keep_image: bool,
}

/// A change of a camera.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "paused": true }))]
pub(in crate::api) struct CameraChange {
    /// `true` to read no frames.
    #[schema(nullable = false)]
    paused: Option<bool>,
    /// `true` to keep the latest image, as for a camera in the setting `results.images`. After
    /// `false`, the next frame removes it.
    #[schema(nullable = false)]
    keep_image: Option<bool>,
}

/// The JSON of a request about a camera.
pub(in crate::api) struct CameraBody<T>(T);

impl<T: DeserializeOwned> FromRequest<ApiState> for CameraBody<T> {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &ApiState) -> Result<Self, Problem> {
        let (parts, body) = request.into_parts();
        let context = RequestContext::from_extensions(&parts.extensions)?;
        let reader = state.body_reader(&context, MAX_BYTES, "send what /docs shows for this route");
        let bytes = reader.read(&parts.headers, body).await?.into_bytes();
        serde_json::from_slice(&bytes).map(Self).map_err(|error| {
            let (field, fault) = fault::<T>(&bytes, &error);
            Problem::for_parameter(ProblemKind::InvalidParameter, &field, &fault)
        })
    }
}

/// Returns the field at fault and its fault. Values are not repeated: one may be a password.
fn fault<T: DeserializeOwned>(body: &[u8], error: &serde_json::Error) -> (String, String) {
    let is_without_fault = |fields: &Map<String, Value>, name: &str| {
        let mut others = fields.clone();
        others.remove(name);
        // A required field at fault is missing without it.
        serde_json::from_value::<T>(others.into()).map_or_else(
            |error| error.to_string().starts_with("missing field"),
            |_| true,
        )
    };
    let fields = serde_json::from_slice::<Map<String, Value>>(body).unwrap_or_default();
    let field = fields.keys().find(|name| is_without_fault(&fields, name));
    let message = error.to_string();
    match field {
        Some(field) if message.starts_with("unknown field") => {
            let known: Vec<_> = message.split('`').skip(3).step_by(2).collect();
            let fault = format!("there is no such field: use {}", known.join(", "));
            (one_line(field), fault)
        }
        Some(field) => {
            let fault = "it has a value of another type: compare it with /docs";
            (field.clone(), fault.to_owned())
        }
        None => {
            let fault = format!(
                "line {}: not the JSON of this route: compare it with /docs",
                error.line()
            );
            ("body".to_owned(), fault)
        }
    }
}

impl NewCamera {
    fn separate(self) -> (StoredCamera, Option<Secret>) {
        let camera = StoredCamera {
            url: self.url,
            user: self.user.filter(|user| !user.is_empty()),
            every: self.every,
            calibration: self.calibration,
            profile: self.profile,
            paused: self.paused,
            keep_image: self.keep_image,
        };
        (camera, self.password.map(Secret::from))
    }
}

/// List cameras
///
/// The cameras of the settings and those that were added here, by name.
#[utoipa::path(
    get, path = "/cameras", tag = "cameras", operation_id = "list_cameras",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses((status = OK, description = "By name.", body = Vec<CameraInfo>))
)]
pub(in crate::api) async fn list(
    State(state): State<ApiState>,
    _reader: RequireRead,
    deadline: Deadline,
) -> Result<impl IntoResponse, Problem> {
    let rows = rows(&state, cameras(&state)?, deadline).await?;
    Ok(([(CACHE_CONTROL, "no-store")], Json(rows)))
}

/// Get a camera
///
/// Returns its source without a password, and its state.
#[utoipa::path(
    get, path = "/cameras/{camera}", tag = "cameras", operation_id = "get_camera",
    params(("camera" = String, Path, description = "The name of the camera.", example = "hall")),
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses((status = OK, description = "The camera.", body = CameraInfo))
)]
pub(in crate::api) async fn get(
    State(state): State<ApiState>,
    _reader: RequireRead,
    deadline: Deadline,
    Path(name): Path<String>,
) -> Result<impl IntoResponse, Problem> {
    let rows = rows(&state, cameras(&state)?, deadline).await?;
    let row = rows.into_iter().find(|row| row.name == name);
    let row = row.ok_or_else(unknown)?;
    Ok(([(CACHE_CONTROL, "no-store")], Json(row)))
}

/// Create or replace a camera
///
/// The camera is stored and read within two seconds. Its password is never returned.
#[utoipa::path(
    put, path = "/cameras/{camera}", tag = "cameras", operation_id = "put_camera",
    params(("camera" = String, Path, pattern = "^[a-z0-9][a-z0-9_-]{0,63}$",
        description = "The name of the camera.", example = "hall")),
    request_body(content = NewCamera, content_type = "application/json"),
    security((), ("bearer" = ["admin"]), ("api_key" = ["admin"])),
    responses(
        (status = CREATED, description = "The camera is new."),
        (status = NO_CONTENT, description = "The camera is replaced."),
    )
)]
pub(in crate::api) async fn put(
    State(state): State<ApiState>,
    _admin: RequireAdmin,
    deadline: Deadline,
    Path(name): Path<String>,
    CameraBody(camera): CameraBody<NewCamera>,
) -> Result<StatusCode, Problem> {
    let (camera, password) = camera.separate();
    let (stored_name, keep_image) = (name.clone(), camera.keep_image);
    let is_new = using_files(&state, deadline, move |cameras| {
        cameras.put(&stored_name, camera, password.as_ref())
    });
    let is_new = is_new.await?;
    if !(is_new || keep_image) {
        state.results.delete_image(&name).await?;
    }
    tracing::info!(camera = name, "the camera was stored");
    Ok(stored_status(is_new))
}

/// Change a camera
///
/// Pauses or resumes it, and switches whether its latest image is kept: `false` deletes the
/// stored one. It stays so after a restart. This change applies to cameras of the settings, too.
#[utoipa::path(
    patch, path = "/cameras/{camera}", tag = "cameras", operation_id = "change_camera",
    params(("camera" = String, Path, description = "The name of the camera.", example = "hall")),
    request_body(content = CameraChange, content_type = "application/json"),
    security((), ("bearer" = ["admin"]), ("api_key" = ["admin"])),
    responses((status = NO_CONTENT, description = "The camera is changed."))
)]
pub(in crate::api) async fn patch(
    State(state): State<ApiState>,
    _admin: RequireAdmin,
    deadline: Deadline,
    Path(name): Path<String>,
    CameraBody(CameraChange { paused, keep_image }): CameraBody<CameraChange>,
) -> Result<StatusCode, Problem> {
    let changed_name = name.clone();
    let is_known = using_files(&state, deadline, move |cameras| {
        cameras.change(&changed_name, paused, keep_image)
    });
    if !is_known.await? {
        return Err(unknown());
    }
    if keep_image == Some(false) {
        state.results.delete_image(&name).await?;
    }
    tracing::info!(camera = name, paused, keep_image, "the camera was changed");
    Ok(StatusCode::NO_CONTENT)
}

/// Delete a camera
///
/// Deletes the camera with its password and its reports. The history of its counts stays until
/// `DELETE /counts/{camera}`.
#[utoipa::path(
    delete, path = "/cameras/{camera}", tag = "cameras", operation_id = "delete_camera",
    params(("camera" = String, Path, description = "The name of the camera.", example = "hall")),
    security((), ("bearer" = ["admin"]), ("api_key" = ["admin"])),
    responses((status = NO_CONTENT, description = "The camera is deleted."))
)]
pub(in crate::api) async fn delete(
    State(state): State<ApiState>,
    _admin: RequireAdmin,
    deadline: Deadline,
    Path(name): Path<String>,
) -> Result<StatusCode, Problem> {
    let deleted_name = name.clone();
    let delete = move |cameras: &Cameras| cameras.delete(&deleted_name);
    if !using_files(&state, deadline, delete).await? {
        return Err(unknown());
    }
    // Until its end, the camera would return with its next report.
    let cameras = cameras(&state)?;
    let ended = async {
        while cameras.is_watched(&name) {
            sleep(END_CHECK).await;
        }
    };
    let _ = timeout(END_TIMEOUT, ended).await;
    state.results.delete(&name).await?;
    counts::remove(&state, &name).await;
    let (views, of) = (Arc::clone(&state.options.views), name.clone());
    let removed = deadline.using(&CAMERAS, move || views.remove(&of).map_err(refused));
    removed.await?;
    let (forgotten, references) = (name.clone(), state.clone());
    let forget = move || references.references.forget(&forgotten, Timestamp::now());
    deadline.using(&CAMERAS, forget).await?;
    tracing::info!(camera = name, "the camera was deleted");
    Ok(StatusCode::NO_CONTENT)
}

/// Test a camera
///
/// Returns its first frame within 15 seconds, or the reason why there is none. Nothing is stored.
#[utoipa::path(
    post, path = "/cameras/test", tag = "cameras", operation_id = "test_camera",
    request_body(content = NewCamera, content_type = "application/json"),
    security((), ("bearer" = ["admin"]), ("api_key" = ["admin"])),
    responses((status = OK, description = "The first frame.", content((inline(RawBytes) = "image/jpeg"))))
)]
pub(in crate::api) async fn test(
    State(state): State<ApiState>,
    _admin: RequireAdmin,
    CameraBody(camera): CameraBody<NewCamera>,
) -> Result<Response, Problem> {
    let cameras = cameras(&state)?;
    let (camera, password) = camera.separate();
    let tested = cameras.test(&camera, password).await;
    let frame = tested.map_err(refused)?;
    Ok(answer(frame.format.media_type(), frame.image))
}

/// Get the present frame
///
/// Reads a frame of the camera within 15 seconds, with nothing concealed. Nothing is stored.
#[utoipa::path(
    get, path = "/cameras/{camera}/frame.jpg", tag = "cameras", operation_id = "get_camera_frame",
    params(("camera" = String, Path, description = "The name of the camera.", example = "hall")),
    security((), ("bearer" = ["admin"]), ("api_key" = ["admin"])),
    responses((status = OK, description = "The frame.", content((inline(RawBytes) = "image/jpeg"))))
)]
pub(in crate::api) async fn get_frame(
    State(state): State<ApiState>,
    _admin: RequireAdmin,
    deadline: Deadline,
    Path(name): Path<String>,
) -> Result<Response, Problem> {
    let camera = using_files(&state, deadline, move |cameras| Ok(cameras.get(&name)?)).await?;
    let camera = camera.ok_or_else(unknown)?;
    let frame = cameras(&state)?.frame(&camera).await.map_err(refused)?;
    Ok(answer(frame.format.media_type(), frame.image))
}

fn answer(media_type: &'static str, image: impl IntoResponse) -> Response {
    let headers = [(CONTENT_TYPE, media_type), (CACHE_CONTROL, "no-store")];
    (headers, image).into_response()
}

/// Returns the cameras of this process.
fn cameras(state: &ApiState) -> Result<Arc<Cameras>, Problem> {
    state.options.companions.cameras().ok_or_else(|| {
        let detail = "this server reads no cameras: start `lookdown run`";
        Problem::new(ProblemKind::NotFound, detail)
    })
}

/// Uses the files of the cameras without blocking the runtime.
async fn using_files<T: Send + 'static>(
    state: &ApiState,
    deadline: Deadline,
    work: impl FnOnce(&Cameras) -> Result<T, CameraError> + Send + 'static,
) -> Result<T, Problem> {
    let cameras = cameras(state)?;
    let done = deadline.using(&CAMERAS, move || work(&cameras).map_err(refused));
    done.await
}

/// Returns the status after something was stored.
fn stored_status(is_new: bool) -> StatusCode {
    if is_new {
        StatusCode::CREATED
    } else {
        StatusCode::NO_CONTENT
    }
}

fn unknown() -> Problem {
    Problem::new(
        ProblemKind::NotFound,
        "there is no such camera: GET /cameras lists them",
    )
}

fn refused(error: CameraError) -> Problem {
    match error {
        CameraError::Folder(..) => Problem::internal(error),
        CameraError::Busy => Problem::new(ProblemKind::Overloaded, error.to_string()),
        CameraError::Configured(_) => Problem::new(ProblemKind::CameraConflict, error.to_string()),
        CameraError::Invalid(_) | CameraError::Source(_) => {
            Problem::new(ProblemKind::InvalidParameter, error.to_string())
        }
    }
}

/// A camera and its state.
#[derive(Default, Serialize, ToSchema)]
struct CameraInfo {
    /// The name.
    name: String,
    /// The source, without password and query.
    source: String,
    /// `true` if the camera can be changed and deleted here, `false` if it is one of the settings.
    stored: bool,
    /// `true` if no frames are read. A change takes about two seconds.
    paused: bool,
    /// `true` if the latest image is kept, by the camera or by the setting `results.images`.
    keep_image: bool,
    /// The user name of a stored camera.
    user: Option<String>,
    /// The interval of a stored camera.
    every: Option<String>,
    /// The calibration of a stored camera.
    calibration: Option<String>,
    /// The profile of a stored camera.
    profile: Option<String>,
    /// Time since the last whole frame, or since the start without a frame.
    last_frame_age_seconds: Option<f64>,
    /// Frames per second that the settings want, in the last whole minute.
    wanted_rate: Option<f64>,
    /// Frames per second with a report, in the last whole minute.
    reached_rate: Option<f64>,
    /// The profile and the rate in use, with the time of a search that they were chosen by.
    choice: Option<String>,
    /// The reason and the remedies, if less than 80 % of the wanted rate is reached, if the machine
    /// is too slow for counts, or if reports are not counted.
    warning: Option<String>,
    /// The reason why there are no frames.
    problem: Option<String>,
    /// `GET /cameras/{camera}/suggested-calibration`; `null` if it needs none or had no frame.
    suggestion: Option<SuggestionState>,
}

/// Returns all cameras by name.
async fn rows(
    state: &ApiState,
    cameras: Arc<Cameras>,
    deadline: Deadline,
) -> Result<Vec<CameraInfo>, Problem> {
    let read = move || {
        let stored = cameras.stored()?;
        let paused = cameras.paused_of_settings()?;
        Ok((cameras.states(&stored), stored, paused, cameras.problems()))
    };
    let read = deadline.using(&CAMERAS, move || {
        read().map_err(|error: ConfigError| Problem::internal(error))
    });
    let (states, stored, paused, problems) = read.await?;
    let mut rows: Vec<_> = states
        .into_iter()
        .map(|state| CameraInfo {
            choice: state.choice.map(|choice| choice.to_string()),
            warning: state.warning,
            wanted_rate: state.rate.map(|rate| rate.wanted),
            reached_rate: state.rate.map(|rate| rate.reached),
            last_frame_age_seconds: Some(state.last_frame_age.as_secs_f64()),
            problem: state.problem,
            name: state.name,
            source: state.source,
            ..CameraInfo::default()
        })
        .collect();
    for (name, source) in paused {
        // A camera that has just been paused may still be watched.
        let row = row_of(&mut rows, &name);
        row.paused = row.last_frame_age_seconds.is_none();
        row.source = source;
    }
    for (name, problem) in problems {
        let row = row_of(&mut rows, &name);
        (row.stored, row.problem) = (true, Some(problem));
    }
    for (name, camera) in stored {
        let row = row_of(&mut rows, &name);
        row.source = camera.shown_source();
        row.stored = true;
        row.paused = camera.paused && row.last_frame_age_seconds.is_none();
        row.user = camera.user;
        row.every = camera.every;
        row.calibration = camera.calibration;
        row.profile = camera.profile;
    }
    for row in &mut rows {
        row.keep_image = state.keeps_image(&row.name);
        let suggestion = state.suggestions.for_camera(&row.name);
        row.suggestion = suggestion.as_ref().map(SuggestionState::new);
        let of_counts = || state.options.companions.count_warning(&row.name);
        let of_counts = || (!row.paused).then(of_counts).flatten();
        row.warning = row.warning.take().or_else(of_counts);
    }
    rows.sort_unstable_by(|one, other| one.name.cmp(&other.name));
    Ok(rows)
}

/// Returns the row of a camera, a new one if there is none.
fn row_of<'a>(rows: &'a mut Vec<CameraInfo>, name: &str) -> &'a mut CameraInfo {
    let index = rows.iter().position(|row| row.name == name);
    let index = index.unwrap_or(rows.len());
    if index == rows.len() {
        rows.push(CameraInfo {
            name: name.to_owned(),
            ..CameraInfo::default()
        });
    }
    &mut rows[index]
}
