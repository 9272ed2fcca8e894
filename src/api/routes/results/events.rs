//! Streams of reports: server-sent events (HTML Living Standard, section 9.2).

use std::{convert::Infallible, future::pending, sync::Arc, time::Duration};

use axum::{
    extract::State,
    http::{HeaderMap, HeaderName, Uri},
    response::{
        IntoResponse, Response,
        sse::{KeepAlive, Sse},
    },
};
use futures_util::stream::unfold;
use tokio::time::sleep;

use super::{
    address::CameraAddress,
    feed::{Feed, ViewBoxes},
};
use crate::{
    api::{
        ApiState,
        http::{caller::Caller, problem::Problem, query::parameters_named},
        require_scope::RequireRead,
    },
    results::Cameras,
};

pub(in crate::api) const LAST_EVENT_ID: HeaderName = HeaderName::from_static("last-event-id");
/// Interval without a report after which a keep-alive comment is sent. Proxies close silent
/// connections, and the comment detects clients that have disconnected.
pub(in crate::api) const KEEP_ALIVE: Duration = Duration::from_secs(15);
/// Interval of the checks that the key of a stream is still valid.
const KEY_CHECK: Duration = Duration::from_secs(1);
/// Disables the response buffering of nginx and compatible proxies.
pub(in crate::api) const ACCEL_BUFFERING: HeaderName = HeaderName::from_static("x-accel-buffering");

/// Stream the reports of a camera
///
/// Server-sent events: the latest report at once, then each new report with its ID. A client that
/// reconnects with `Last-Event-ID`, as browsers do automatically, first receives the missed reports
/// that are still stored.
#[utoipa::path(
    get, path = "/results/{camera}/events", tag = "results", operation_id = "listen_to_camera",
    params(
        ("camera" = String, Path, description = "The name of the camera; it need not have a report yet."),
        ("view" = Option<String>, Query, nullable = false, description = "The name of a view of the camera: \
            each person has `view_boxes` with its box in the pixels of the view, or null."),
        ("Last-Event-ID" = Option<String>, Header, nullable = false,
            description = "The ID of the last report that the client received."),
    ),
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses(
        (status = OK, description = "An unlimited stream; the data of each event is a report.",
         body = String, content_type = "text/event-stream"),
    )
)]
pub(in crate::api) async fn camera_events(
    State(state): State<ApiState>,
    _reader: RequireRead,
    caller: Caller,
    CameraAddress(camera): CameraAddress,
    headers: HeaderMap,
    uri: Uri,
) -> Result<Response, Problem> {
    let [view] = parameters_named(&uri, ["view"])?;
    let boxes = view.map(|name| ViewBoxes {
        views: Arc::clone(&state.options.views),
        camera: camera.clone(),
        name,
    });
    stream(state, &caller, Cameras::One(camera), headers, boxes).await
}

/// Stream all reports
///
/// Server-sent events: the latest report of each camera, then every new report.
#[utoipa::path(
    get, path = "/events", tag = "results", operation_id = "listen_to_all",
    params(
        ("Last-Event-ID" = Option<String>, Header, nullable = false,
            description = "The ID of the last report that the client received."),
    ),
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses(
        (status = OK, description = "An unlimited stream; the data of each event is a report.",
         body = String, content_type = "text/event-stream"),
    )
)]
pub(in crate::api) async fn all_events(
    State(state): State<ApiState>,
    _reader: RequireRead,
    caller: Caller,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    stream(state, &caller, Cameras::All, headers, None).await
}

async fn stream(
    state: ApiState,
    caller: &Caller,
    cameras: Cameras,
    headers: HeaderMap,
    boxes: Option<ViewBoxes>,
) -> Result<Response, Problem> {
    let last_heard = headers.get(LAST_EVENT_ID);
    // An invalid ID does not come from this server and is ignored.
    let last_heard = last_heard.and_then(|id| id.to_str().ok()?.parse().ok());
    let feed = Feed::begin(
        Arc::clone(&state.results),
        &caller.client,
        cameras,
        last_heard,
        boxes,
    )
    .await?;
    let listener = (feed, state, headers);
    let events = unfold(listener, async |(mut feed, state, headers)| {
        let event = tokio::select! {
            event = feed.next() => event?,
            () = key_removed(&state, &headers) => return None,
        };
        // A stream must not outlive its key.
        RequireRead::check_again(&state, &headers).ok()?;
        Some((Ok::<_, Infallible>(event), (feed, state, headers)))
    });
    let events = Sse::new(events).keep_alive(KeepAlive::new().interval(KEEP_ALIVE));
    let headers = [(ACCEL_BUFFERING, "no")];
    Ok((headers, events).into_response())
}

/// Waits until the key of a stream is removed.
async fn key_removed(state: &ApiState, headers: &HeaderMap) {
    if !state.options.access.needs_keys() {
        return pending().await;
    }
    while RequireRead::check_again(state, headers).is_ok() {
        sleep(KEY_CHECK).await;
    }
}
