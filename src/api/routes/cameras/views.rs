//! The straight views of a camera, and their images: JPEG and MJPEG.

use std::{sync::Arc, time::Duration};

use axum::{
    Json,
    body::Body,
    extract::{FromRequestParts, Path, Request, State},
    http::{
        HeaderMap, HeaderValue, StatusCode,
        header::{CACHE_CONTROL, CONTENT_TYPE, WWW_AUTHENTICATE},
        request::Parts,
    },
    response::{IntoResponse, Response},
};
use bytes::{BufMut, Bytes, BytesMut};
use futures_util::stream::unfold;
use lookdown_common::text::Quoted;
use lookdown_detect::parameters::{ParameterError, whole_number};
use lookdown_http::entity_tags::{is_unmodified, private};
use lookdown_watch::Viewing;
use serde_json::Value;
use tokio::time::{timeout, timeout_at};
use utoipa::{IntoParams, OpenApi};

use super::{CameraBody, refused, stored_status};
use crate::{
    api::{
        ApiState,
        http::{
            access::Caller,
            context::RequestContext,
            deadline::{CAMERAS, Deadline},
            problem::{Problem, ProblemKind},
            query::parameters_named,
        },
        openapi::RawBytes,
        require_scope::{RequireAdmin, RequireRead, RequireView},
        routes::results::events::{ACCEL_BUFFERING, KEEP_ALIVE},
    },
    results::{Cameras, Listening},
    views::{LiveCamera, LiveFrame, Rendering, View, ViewError, Views},
};

/// The separator of the parts of an MJPEG stream.
const BOUNDARY: &str = "frame";
/// Longest wait of a request for the first frame of a camera.
const FIRST_FRAME: Duration = Duration::from_secs(5);

/// The query parameters of an image of a view.
#[derive(IntoParams)]
#[into_params(parameter_in = Query)]
#[expect(dead_code, reason = "documents the query that ImageRequest parses")]
struct ImageQuery {
    /// Quality of the JPEG; 80 by default.
    #[param(minimum = 1, maximum = 100)]
    quality: Option<u8>,
    /// `true` to draw the boxes of the last report.
    boxes: Option<bool>,
    /// `true` to draw the zones with their names.
    zones: Option<bool>,
    /// `true` to draw the counting lines with their names.
    lines: Option<bool>,
    /// `true` to write the number of persons.
    number: Option<bool>,
    /// The key, for clients that send neither a header nor a password.
    key: Option<String>,
    /// A kind instead of the stored one. This and the next five need the scope `admin`; the name
    /// of the view is then free.
    kind: Option<String>,
    /// A direction instead of the stored one, degrees.
    azimuth_deg: Option<f64>,
    /// An angle from straight down instead of the stored one, degrees.
    tilt_deg: Option<f64>,
    /// A field of view instead of the stored one, degrees.
    field_of_view_deg: Option<f64>,
    /// A width instead of the stored one, pixels.
    width: Option<u32>,
    /// A height instead of the stored one, pixels.
    height: Option<u32>,
}

/// The image routes: paths that the router cannot tell from [`get`] by their endings.
#[derive(OpenApi)]
#[openapi(paths(get_image, get_stream))]
pub(in crate::api) struct ImageRoutes;

/// List the views of a camera
///
/// Straight views are directions, panoramas and a person that is followed. The newest frame of a
/// camera with views is kept in memory.
#[utoipa::path(
    get, path = "/cameras/{camera}/views", tag = "cameras", operation_id = "list_camera_views",
    params(("camera" = String, Path, description = "The name of the camera.", example = "hall")),
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses((status = OK, description = "By name.", body = Vec<View>))
)]
pub(in crate::api) async fn list(
    State(state): State<ApiState>,
    _reader: RequireRead,
    Path(camera): Path<String>,
) -> impl IntoResponse {
    let views = state.options.views.list(&camera).into_iter();
    let named = |(name, view)| View {
        name: Some(name),
        ..view
    };
    let views: Vec<View> = views.map(named).collect();
    ([(CACHE_CONTROL, "no-store")], Json(views))
}

/// Get a view
#[utoipa::path(
    get, path = "/cameras/{camera}/views/{name}", tag = "cameras", operation_id = "get_camera_view",
    params(
        ("camera" = String, Path, description = "The name of the camera.", example = "hall"),
        ("name" = String, Path, description = "The name of the view.", example = "door"),
    ),
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses((status = OK, description = "The view.", body = View))
)]
pub(in crate::api) async fn get(
    State(state): State<ApiState>,
    request: Request,
) -> Result<Response, Problem> {
    let (mut parts, _) = request.into_parts();
    let path = Path::<(String, String)>::from_request_parts(&mut parts, &state).await;
    let Path((camera, file)) = path.map_err(|_| unknown(&state, "", ""))?;
    let answered = match file.rsplit_once('.') {
        Some((name, "jpg")) => get_image(state, parts, &camera, name).await,
        Some((name, "mjpg")) => get_stream(state, parts, camera, name.to_owned()).await,
        _ => {
            RequireRead::from_request_parts(&mut parts, &state).await?;
            return Ok(Json(stored(&state, &camera, &file)?).into_response());
        }
    };
    Ok(answered.unwrap_or_else(|problem| {
        let is_without_key = problem.kind == ProblemKind::KeyRequired;
        let mut response = problem.into_response();
        if is_without_key {
            // Players of streams send the password of their URL after this challenge only.
            let scheme = HeaderValue::from_static("Basic realm=\"Lookdown\"");
            response.headers_mut().append(WWW_AUTHENTICATE, scheme);
        }
        response
    }))
}

/// Create or replace a view
///
/// Values that are omitted have their defaults: a view of 960 × 720 pixels.
#[utoipa::path(
    put, path = "/cameras/{camera}/views/{name}", tag = "cameras", operation_id = "put_camera_view",
    params(
        ("camera" = String, Path, description = "The name of the camera.", example = "hall"),
        ("name" = String, Path, pattern = "^[a-z0-9][a-z0-9_-]{0,63}$", description = "The name of the view.",
            example = "door"),
    ),
    request_body(content = View, content_type = "application/json"),
    security((), ("bearer" = ["admin"]), ("api_key" = ["admin"])),
    responses(
        (status = CREATED, description = "The view is new."),
        (status = NO_CONTENT, description = "The view is replaced."),
    )
)]
pub(in crate::api) async fn put(
    State(state): State<ApiState>,
    _admin: RequireAdmin,
    deadline: Deadline,
    Path((camera, name)): Path<(String, String)>,
    CameraBody(mut view): CameraBody<View>,
) -> Result<StatusCode, Problem> {
    view.name = None;
    view.check()?;
    if let Some(live) = state.options.views.live(&camera) {
        live.check(&view)?;
    }
    let store = move |views: &Views| views.put(&camera, &name, view).map_err(refused);
    using_file(&state, deadline, store).await.map(stored_status)
}

/// Delete a view
#[utoipa::path(
    delete, path = "/cameras/{camera}/views/{name}", tag = "cameras", operation_id = "delete_camera_view",
    params(
        ("camera" = String, Path, description = "The name of the camera.", example = "hall"),
        ("name" = String, Path, description = "The name of the view.", example = "door"),
    ),
    security((), ("bearer" = ["admin"]), ("api_key" = ["admin"])),
    responses((status = NO_CONTENT, description = "The view is deleted."))
)]
pub(in crate::api) async fn delete(
    State(state): State<ApiState>,
    _admin: RequireAdmin,
    deadline: Deadline,
    Path((camera, name)): Path<(String, String)>,
) -> Result<StatusCode, Problem> {
    let (of, named) = (camera.clone(), name.clone());
    let delete = move |views: &Views| views.delete(&of, &named).map_err(refused);
    if using_file(&state, deadline, delete).await? {
        return Ok(StatusCode::NO_CONTENT);
    }
    Err(unknown(&state, &camera, &name))
}

/// Get the image of a view
///
/// Renders the newest frame of the camera, with its masks. If people are concealed in stored images
/// (`results.conceal_images`), they are here, too. `If-None-Match` with the `ETag` of a known image
/// returns 304 until there is a newer frame. The key may also be the password of Basic
/// authentication.
#[utoipa::path(
    get, path = "/cameras/{camera}/views/{name}.jpg", tag = "cameras", operation_id = "get_camera_view_image",
    params(
        ("camera" = String, Path, description = "The name of the camera.", example = "hall"),
        ("name" = String, Path, description = "The name of the view.", example = "door"),
        ImageQuery,
        ("If-None-Match" = Option<String>, Header, nullable = false, pattern = r#"^(\*|"[!#-~]*")$"#,
            description = "The ETag of the known image."),
    ),
    security((), ("bearer" = ["view"]), ("api_key" = ["view"])),
    responses(
        (status = OK, description = "The image.", content((inline(RawBytes) = "image/jpeg")),
         headers(("ETag" = String, description = "It changes with the frame and with the view."))),
        (status = NOT_MODIFIED, description = "There is no newer frame."),
    )
)]
async fn get_image(
    state: ApiState,
    parts: Parts,
    camera: &str,
    name: &str,
) -> Result<Response, Problem> {
    let request = ImageRequest::begin(&state, &parts, camera, name)?;
    let deadline = RequestContext::from_extensions(&parts.extensions)?.deadline;
    let rendering = request.rendering(&state, camera, name).await?;
    let live = request.live(&state, camera, name)?;
    let frame = newest(&state, &live, camera, deadline).await?;
    let tag = frame.tag(&rendering);
    let about = private(&tag);
    if is_unmodified(&parts.headers, &tag)? {
        return Ok((StatusCode::NOT_MODIFIED, about).into_response());
    }
    let rendered = timeout_at(deadline.at(), live.jpeg(&frame, &rendering)).await;
    let rendered = rendered.map_err(|_| {
        let detail = "the view was not rendered in time: send fewer requests, or lower width";
        Problem::new(ProblemKind::Timeout, detail)
    })?;
    Ok((about, [(CONTENT_TYPE, "image/jpeg")], rendered?).into_response())
}

/// Watch a view
///
/// An MJPEG stream of each new frame of the camera. A client that reads slowly misses frames. In
/// `lookdown run`, the camera then delivers all of its frames.
#[utoipa::path(
    get, path = "/cameras/{camera}/views/{name}.mjpg", tag = "cameras", operation_id = "watch_camera_view",
    params(
        ("camera" = String, Path, description = "The name of the camera.", example = "hall"),
        ("name" = String, Path, description = "The name of the view.", example = "door"),
        ImageQuery,
    ),
    security((), ("bearer" = ["view"]), ("api_key" = ["view"])),
    responses((status = OK, description = "An unlimited stream of JPEG files.",
        content((inline(RawBytes) = "multipart/x-mixed-replace"))))
)]
async fn get_stream(
    state: ApiState,
    parts: Parts,
    camera: String,
    name: String,
) -> Result<Response, Problem> {
    let request = ImageRequest::begin(&state, &parts, &camera, &name)?;
    let live = request.live(&state, &camera, &name)?;
    // It has a permit of the streams, and ends with the server.
    let listening = state
        .results
        .listen(&request.caller.client, Cameras::One(camera.clone()));
    let listening = listening.await?;
    let viewer = Viewer {
        _viewing: state.options.views.add_viewer(&camera),
        frames: live.frames(),
        live,
        listening,
        request,
        camera,
        name,
        headers: parts.headers,
        is_first: true,
        state,
    };
    let parts = unfold(viewer, async |mut viewer| {
        let part = viewer.next().await?;
        Some((Ok::<_, std::convert::Infallible>(part), viewer))
    });
    let content_type = format!("multipart/x-mixed-replace; boundary={BOUNDARY}");
    let headers = [
        (CONTENT_TYPE, content_type),
        (CACHE_CONTROL, "no-store".to_owned()),
    ];
    Ok(([(ACCEL_BUFFERING, "no")], headers, Body::from_stream(parts)).into_response())
}

/// The query of an image, and its caller.
struct ImageRequest {
    /// The options, with another view and no number.
    options: Rendering,
    number: bool,
    /// Values instead of the stored ones.
    changes: Vec<(&'static str, Value)>,
    key: Option<String>,
    caller: Caller,
}

impl ImageRequest {
    /// Checks the key and the query.
    fn begin(state: &ApiState, parts: &Parts, camera: &str, name: &str) -> Result<Self, Problem> {
        const NAMES: [&str; 12] = [
            "quality",
            "key",
            "boxes",
            "zones",
            "lines",
            "number",
            "kind",
            "azimuth_deg",
            "tilt_deg",
            "field_of_view_deg",
            "width",
            "height",
        ];
        let [quality, key, boxes, zones, lines, number, given @ ..] =
            parameters_named(&parts.uri, NAMES)?;
        let (_, holder) = RequireView::with_key(state, &parts.headers, key.as_deref())?;
        let context = RequestContext::from_extensions(&parts.extensions)?;
        let caller = context.caller.clone();
        let caller = caller.with_holder(&state.options.access, holder.as_ref());
        let mut changes = Vec::new();
        for (name, value) in NAMES[6..].iter().copied().zip(given) {
            let Some(value) = value else { continue };
            // A number in JSON, or else a word.
            let parsed = value.parse::<serde_json::Number>();
            changes.push((name, parsed.map_or(Value::from(value), Value::from)));
        }
        if !changes.is_empty() {
            RequireAdmin::with_key(state, &parts.headers, key.as_deref())?;
        } else if !state.options.views.list(camera).contains_key(name) {
            return Err(unknown(state, camera, name));
        }
        let mut options = Rendering::new(View::default());
        if let Some(quality) = quality {
            options.quality = whole_number("quality", &quality, 1..=100)?;
        }
        options.boxes = flag("boxes", boxes.as_deref())?;
        options.zones = flag("zones", zones.as_deref())?;
        options.lines = flag("lines", lines.as_deref())?;
        Ok(Self {
            options,
            number: flag("number", number.as_deref())?,
            changes,
            key,
            caller,
        })
    }

    /// Returns the view as the request changes it, with the options.
    async fn rendering(
        &self,
        state: &ApiState,
        camera: &str,
        name: &str,
    ) -> Result<Rendering, Problem> {
        let mut rendering = self.options.clone();
        rendering.view = match stored(state, camera, name) {
            view if self.changes.is_empty() => view?,
            view => self.changed(view.unwrap_or_default())?,
        };
        // Without an answer of the result store, there is no number.
        if self.number
            && let Ok(Some(latest)) = state.results.latest(camera).await
            && let Ok(headline) = state.headline(&latest).await
        {
            rendering.number = headline.number.map(|number| number.persons);
        }
        Ok(rendering)
    }

    /// Returns a view with the values of the request.
    fn changed(&self, mut view: View) -> Result<View, Problem> {
        for (name, value) in &self.changes {
            let mut fields = serde_json::to_value(view).map_err(Problem::internal)?;
            fields[*name] = value.clone();
            let changed = serde_json::from_value(fields);
            view = changed.map_err(|_| {
                ParameterError::is_not(name, &value.to_string(), "a value of a view")
            })?;
        }
        view.check()?;
        Ok(view)
    }

    /// Returns the newest frame of the camera.
    fn live(&self, state: &ApiState, camera: &str, name: &str) -> Result<Arc<LiveCamera>, Problem> {
        let views = &state.options.views;
        if !self.changes.is_empty() {
            return views.preview(camera).map_err(refused);
        }
        views
            .live(camera)
            .ok_or_else(|| unknown(state, camera, name))
    }
}

/// A viewer of an MJPEG stream.
struct Viewer {
    state: ApiState,
    live: Arc<LiveCamera>,
    frames: tokio::sync::watch::Receiver<Option<Arc<LiveFrame>>>,
    listening: Listening,
    _viewing: Option<Viewing>,
    request: ImageRequest,
    camera: String,
    name: String,
    headers: HeaderMap,
    is_first: bool,
}

impl Viewer {
    /// Returns the next part of the stream; `None` at its end.
    async fn next(&mut self) -> Option<Bytes> {
        loop {
            if !self.is_first || self.frames.borrow().is_none() {
                self.changed().await?;
            }
            // A stream must not outlive its key, nor its view.
            let key = self.request.key.as_deref();
            RequireView::with_key(&self.state, &self.headers, key).ok()?;
            let rendering = self
                .request
                .rendering(&self.state, &self.camera, &self.name);
            let rendering = rendering.await.ok()?;
            let frame = self.frames.borrow_and_update().clone();
            let Some(frame) = frame else { continue };
            match self.live.jpeg(&frame, &rendering).await {
                Ok(jpeg) => return Some(self.part(&jpeg)),
                Err(ViewError::Ended) => return None,
                // The next frame may be better.
                Err(_) => self.is_first = false,
            }
        }
    }

    /// Waits for a newer frame, or for the time after which the last one is sent again: proxies
    /// close silent connections. `None` at the end of the stream.
    async fn changed(&mut self) -> Option<()> {
        loop {
            tokio::select! {
                changed = timeout(KEEP_ALIVE, self.frames.changed()) => {
                    return changed.map_or(Some(()), Result::ok);
                }
                report = self.listening.next() => drop(report?),
            }
        }
    }

    /// The boundary after a part makes players show it at once.
    fn part(&mut self, jpeg: &[u8]) -> Bytes {
        let mut part = BytesMut::with_capacity(jpeg.len() + 100);
        if std::mem::replace(&mut self.is_first, false) {
            part.put(format!("--{BOUNDARY}\r\n").as_bytes());
        }
        let length = jpeg.len();
        let head = format!("Content-Type: image/jpeg\r\nContent-Length: {length}\r\n\r\n");
        part.put(head.as_bytes());
        part.put(jpeg);
        part.put(format!("\r\n--{BOUNDARY}\r\n").as_bytes());
        part.freeze()
    }
}

/// Returns the newest frame of a camera; waits a moment for its first one.
async fn newest(
    state: &ApiState,
    live: &LiveCamera,
    camera: &str,
    deadline: Deadline,
) -> Result<Arc<LiveFrame>, Problem> {
    let mut frames = live.frames();
    let wait = deadline.within(Some(FIRST_FRAME), "");
    let frame = timeout_at(wait.at(), frames.wait_for(Option::is_some)).await;
    let frame = frame.ok().and_then(|frame| frame.ok()?.clone());
    let is_kept =
        |frame: &Arc<LiveFrame>| frame.age() < state.options.settings.results.limits.max_age;
    frame.filter(is_kept).ok_or_else(|| {
        let camera = Quoted(camera);
        let detail = format!(
            "there is no frame of the camera {camera} yet: the next one with a report is shown"
        );
        Problem::new(ProblemKind::ImageNotKept, detail)
    })
}

/// Uses the file of the views without blocking the runtime.
async fn using_file<T: Send + 'static>(
    state: &ApiState,
    deadline: Deadline,
    work: impl FnOnce(&Views) -> Result<T, Problem> + Send + 'static,
) -> Result<T, Problem> {
    let views = Arc::clone(&state.options.views);
    deadline.using(&CAMERAS, move || work(&views)).await
}

fn flag(name: &str, value: Option<&str>) -> Result<bool, ParameterError> {
    let Some(value) = value else { return Ok(false) };
    let parsed = value.parse();
    parsed.map_err(|_| ParameterError::is_not(name, value, "true or false"))
}

fn stored(state: &ApiState, camera: &str, name: &str) -> Result<View, Problem> {
    let view = state.options.views.list(camera).remove(name);
    view.ok_or_else(|| unknown(state, camera, name))
}

fn unknown(state: &ApiState, camera: &str, name: &str) -> Problem {
    let views = state.options.views.list(camera);
    let known: Vec<_> = views.keys().map(String::as_str).collect();
    let known = if known.is_empty() {
        "none".to_owned()
    } else {
        known.join(", ")
    };
    let (camera, name) = (Quoted(camera), Quoted(name));
    let detail = format!(
        "the camera {camera} has no view {name}: it has {known}; PUT /cameras/{{camera}}/views/{{name}} adds one"
    );
    Problem::new(ProblemKind::NotFound, detail)
}

impl From<ViewError> for Problem {
    fn from(error: ViewError) -> Self {
        match error {
            ViewError::Invalid(error) => error.into(),
            ViewError::Decode(_) | ViewError::Encode(_) => Self::internal(error),
            ViewError::FrameSize => Self::new(ProblemKind::ImageNotKept, error.to_string()),
            ViewError::Ended => Self::shutting_down(),
        }
    }
}
