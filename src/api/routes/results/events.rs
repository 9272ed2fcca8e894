//! Streams of reports: server-sent events (HTML Living Standard, section 9.2).
//!
//! The event source of a subscriber: missed reports, then new ones.

use std::{
    collections::VecDeque, convert::Infallible, future::pending, num::NonZeroUsize, sync::Arc,
    time::Duration,
};

use axum::{
    extract::State,
    http::{HeaderMap, HeaderName, Uri},
    response::{
        IntoResponse, Response,
        sse::{Event, KeepAlive, Sse},
    },
};
use futures_util::stream::unfold;
use lookdown_detect::fairness::Client;
use lookdown_lens::geometry::{OrientedBox, Pixel};
use serde_json::{Value, json};
use tokio::time::sleep;

use super::CameraAddress;
use crate::{
    api::{
        ApiState,
        http::{access::Caller, problem::Problem, query::parameters_named},
        require_scope::RequireRead,
    },
    results::{Cameras, Listening, ReportId, ResultStore, StoredReport},
    rounding::pixels,
    views::Views,
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

/// Pause before a retry when the result store does not respond.
const PAUSE: Duration = Duration::from_secs(1);
/// Largest number of missed reports per read.
const PAGE: usize = 32;

/// The position of a subscriber in the reports.
pub(super) struct Feed {
    results: Arc<dyn ResultStore>,
    cameras: Cameras,
    listening: Listening,
    /// The last report that was sent.
    last: ReportId,
    /// Reports from before the subscription, to be sent first.
    missed: VecDeque<Arc<StoredReport>>,
    /// `true` if the store may have more missed reports.
    behind: bool,
    /// The view whose boxes are added.
    boxes: Option<ViewBoxes>,
}

/// The boxes of the persons in a view of their camera.
pub(super) struct ViewBoxes {
    pub(super) views: Arc<Views>,
    pub(super) camera: String,
    pub(super) name: String,
}

impl ViewBoxes {
    /// Returns a report with the boxes of the view, if there is such a view now.
    fn added_to(&self, report: &[u8]) -> Option<String> {
        let view = self.views.list(&self.camera).remove(&self.name)?;
        let live = self.views.live(&self.camera)?;
        let mut report: Value = serde_json::from_slice(report).ok()?;
        for person in report["persons"].as_array_mut()? {
            let of = |key: &str| person["oriented_box"][key].as_f64();
            let center = Pixel::new(of("cx")?, of("cy")?);
            let angle = of("angle_deg")?.to_radians();
            let oriented = OrientedBox::turned(center, of("width")?, of("height")?, angle);
            let boxes = live.boxes(&view, &[oriented]).ok()?;
            let sides = boxes
                .first()
                .copied()
                .flatten()
                .map(|sides| sides.map(pixels));
            person["view_boxes"] = json!({
                &self.name: sides.map(|[x_min, y_min, x_max, y_max]| {
                    json!({ "x_min": x_min, "y_min": y_min, "x_max": x_max, "y_max": y_max })
                })
            });
        }
        serde_json::to_string(&report).ok()
    }
}

impl Feed {
    /// Continues after the last received report, or begins with the latest one of each camera.
    ///
    /// # Errors
    /// [`Problem`] when there are too many subscribers, or the result store does not respond.
    pub(super) async fn begin(
        results: Arc<dyn ResultStore>,
        client: &Client,
        cameras: Cameras,
        last_heard: Option<ReportId>,
        boxes: Option<ViewBoxes>,
    ) -> Result<Self, Problem> {
        // Subscribes before the first read, so no report is missed in between.
        let listening = results.listen(client, cameras.clone()).await?;
        let latest = match &cameras {
            Cameras::All => results.latest_of_all().await?,
            Cameras::One(camera) => results.latest(camera).await?.into_iter().collect(),
        };
        let newest = latest.last().map(|report| report.id).unwrap_or_default();
        // An ID later than all reports is from another server: no report here follows it.
        let last_heard = last_heard.filter(|id| *id <= newest);
        Ok(Self {
            results,
            cameras,
            listening,
            last: last_heard.unwrap_or(newest),
            behind: last_heard.is_some(),
            boxes,
            missed: match last_heard {
                None => latest.into(),
                Some(_) => VecDeque::new(),
            },
        })
    }

    /// Returns the next event; `None` at the end of the stream.
    pub(super) async fn next(&mut self) -> Option<Event> {
        loop {
            if let Some(missed) = self.missed.pop_front() {
                return Some(self.event(&missed));
            }
            if self.behind {
                let page = NonZeroUsize::new(PAGE).unwrap_or(NonZeroUsize::MIN);
                let missed = self.results.since(&self.cameras, self.last, page).await;
                let Ok(missed) = missed else {
                    sleep(PAUSE).await;
                    continue;
                };
                self.behind = !missed.is_empty();
                self.missed = missed.into();
                continue;
            }
            let report = self.listening.next().await?;
            // Another one was already sent with the missed ones.
            if report.id > self.last {
                return Some(self.event(&report));
            }
        }
    }

    fn event(&mut self, stored: &StoredReport) -> Event {
        self.last = stored.id;
        let json = &stored.report.json;
        let boxes = self.boxes.as_ref();
        let with_boxes = boxes.and_then(|boxes| boxes.added_to(json));
        let event = Event::default().id(stored.id.to_string());
        match with_boxes {
            Some(json) => event.data(json),
            None => event.data(String::from_utf8_lossy(json)),
        }
    }
}
