//! Stored reports, for dashboards: the latest one of each camera, earlier ones, and a stream of new
//! ones.

pub(in crate::api) mod events;

use std::{num::NonZeroUsize, sync::Arc, time::Duration};

use axum::{
    Json,
    extract::{FromRequestParts, Path, State},
    http::{
        HeaderMap, StatusCode, Uri,
        header::{CACHE_CONTROL, CONTENT_TYPE},
        request::Parts,
    },
    response::{IntoResponse, Response},
};
use bytes::{BufMut, Bytes, BytesMut};
use jiff::Timestamp;
use lookdown_calibration::revision::revision_of;
use lookdown_common::{
    report::Report,
    text::{Quoted, one_line},
};
use lookdown_detect::parameters::{ParameterError, whole_number};
use lookdown_http::entity_tags::{
    entity_tag, is_unmodified, private, revalidated, unless_known, weak_entity_tag,
};
use lookdown_tracking::taught::NumberWithBar;
use serde::Serialize;
use tokio::time::timeout_at;
use utoipa::ToSchema;

use super::counts;
use crate::{
    annotated_image::{AnnotationOptions, StoredFrameError},
    api::{
        ApiState,
        http::{
            access::Caller,
            deadline::Deadline,
            problem::{Problem, ProblemKind},
            query::{pairs, parameters_named, query_parameters},
        },
        openapi::{AnnotationQuery, RawBytes},
        require_scope::{RequireAdmin, RequireRead},
    },
    results::{Cameras, Headline, ListenError, ReportId, StoredReport, Unreachable, medians},
};

/// List cameras with reports
///
/// Each entry has the age of the latest report and the number of persons there now. `If-None-Match`
/// with the `ETag` of a known list returns 304 until a report or a number is new.
#[utoipa::path(
    get, path = "/results", tag = "results", operation_id = "list_results",
    params(("If-None-Match" = Option<String>, Header, nullable = false, pattern = r#"^(\*|(W/)?"[!#-~]*")$"#,
        description = "The ETag of the known list.")),
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses(
        (status = OK, description = "By name.", body = Vec<CameraRow>,
         headers(("ETag" = String, description = "It ignores the ages."))),
        (status = NOT_MODIFIED, description = "No report and no number is new."),
    )
)]
pub(in crate::api) async fn list(
    State(state): State<ApiState>,
    _reader: RequireRead,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let now = Timestamp::now();
    let latest = state.results.latest_of_all().await?;
    let mut rows = Vec::with_capacity(latest.len());
    for report in &latest {
        rows.push(CameraRow::at(report, state.headline(report).await?, now));
    }
    rows.sort_unstable_by(|one, other| one.camera.cmp(&other.camera));
    let tag = revision_of(
        format!(
            "{:?}",
            rows.iter().map(CameraRow::state).collect::<Vec<_>>()
        )
        .as_bytes(),
    );
    let about = revalidated(weak_entity_tag(&tag));
    Ok(unless_known(&headers, &tag, about, || Json(rows))?)
}

/// Returns the problem of a camera without a stored report.
fn unknown(camera: &str) -> Problem {
    let camera = Quoted(camera);
    let detail = format!(
        "there is no report of the camera {camera}: GET /results lists the cameras; a frame sent to \
         /detect with this name as the parameter camera adds a report"
    );
    Problem::new(ProblemKind::UnknownCamera, detail)
}

/// The cause is not sent to the client: the log and `/readyz` report it to the operator.
impl From<Unreachable> for Problem {
    fn from(_: Unreachable) -> Self {
        let detail = "the result store does not respond: retry; detection still works";
        Self::new(ProblemKind::ResultsUnreachable, detail)
    }
}

impl From<ListenError> for Problem {
    fn from(error: ListenError) -> Self {
        match error {
            ListenError::Ended => Self::shutting_down(),
            ListenError::Unreachable(error) => error.into(),
            ListenError::Full { .. } | ListenError::ShareUsed { .. } => {
                let detail = format!("{error}: omit wait, or retry later");
                Self::new(ProblemKind::TooManyListeners, detail)
            }
        }
    }
}

/// A camera and its latest report.
#[derive(Debug, Serialize, ToSchema)]
struct CameraRow {
    /// The name of the camera.
    #[schema(example = "lobby")]
    camera: String,
    /// The ID of the latest report: its `ETag` without the quotes.
    #[schema(example = "1763717400412345")]
    id: String,
    /// Time at which the frame of that report arrived (RFC 3339).
    #[schema(format = DateTime, example = "2025-11-21T09:30:00.412Z")]
    received_at: String,
    /// Age of the report in seconds.
    #[schema(minimum = 0, example = 0.731)]
    age_seconds: f64,
    /// Number of persons there now: what reference counts teach, else those whom the counts follow
    /// while their number is known, else the median of the reports of the last 5 s; `null` while
    /// the camera is paused.
    #[schema(example = 3)]
    persons: Option<usize>,
    /// In 90 % of frames, the true number is at least this one.
    #[schema(example = 2)]
    persons_low: Option<usize>,
    /// In 90 % of frames, the true number is at most this one.
    #[schema(example = 5)]
    persons_high: Option<usize>,
    /// The origin of `persons`: `taught`, `tracks`, `median` or `paused`.
    #[schema(example = "median")]
    persons_source: &'static str,
    /// Number of persons in the latest report.
    #[schema(example = 4)]
    frame_persons: usize,
}

impl CameraRow {
    /// Returns the values that change with a report or a number, not with time.
    fn state(&self) -> (&str, &str, [Option<usize>; 3], &'static str) {
        let numbers = [self.persons, self.persons_low, self.persons_high];
        (&self.camera, &self.id, numbers, self.persons_source)
    }

    fn at(latest: &StoredReport, headline: Headline, now: Timestamp) -> Self {
        let age = now.duration_since(latest.id.time()).as_secs_f64();
        Self {
            camera: latest.report.camera.clone(),
            id: latest.id.to_string(),
            received_at: format!("{:.3}", latest.report.received_at),
            // The clock may have been set back since.
            age_seconds: (age.max(0.0) * 1000.0).round() / 1000.0,
            persons: headline.number.map(|number| number.persons),
            persons_low: headline.number.map(|number| number.low),
            persons_high: headline.number.map(|number| number.high),
            persons_source: headline.source.into(),
            frame_persons: latest.report.persons,
        }
    }
}

/// Delete a camera's reports
///
/// Deletes all stored reports of a camera and its image. Home Assistant removes its entities, and
/// the counts keep the history only of a camera that this process does not read. The camera returns
/// with its next frame.
#[utoipa::path(
    delete, path = "/results/{camera}", tag = "results", operation_id = "delete_results",
    params(("camera" = String, Path, description = "The name of the camera.", example = "lobby")),
    security((), ("bearer" = ["admin"]), ("api_key" = ["admin"])),
    responses((status = NO_CONTENT, description = "The reports are deleted."))
)]
pub(super) async fn delete(
    State(state): State<ApiState>,
    _admin: RequireAdmin,
    CameraAddress(camera): CameraAddress,
) -> Result<StatusCode, Problem> {
    state.options.views.forget(&camera);
    let had_reports = state.results.delete(&camera).await?;
    // The furniture that a user confirmed belongs to a camera until that is removed.
    let is_own = state.options.companions.own_cameras().contains(&camera);
    // The counts may know a camera that has had no frame since the start of the server.
    if is_own || counts::remove(&state, &camera).await || had_reports {
        tracing::info!(camera, "all reports of the camera were deleted");
        Ok(StatusCode::NO_CONTENT)
    } else {
        Err(unknown(&camera))
    }
}

/// The name of a camera; it need not have reports.
pub(in crate::api) struct CameraAddress(pub(super) String);

impl FromRequestParts<ApiState> for CameraAddress {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &ApiState) -> Result<Self, Problem> {
        let camera = Path::from_request_parts(parts, state).await;
        // A path segment that is not UTF-8 is not a name.
        let Path(camera) = camera.map_err(|_| unknown(parts.uri.path()))?;
        Ok(Self(camera))
    }
}

const DEFAULT_LIMIT: usize = 100;
const MAX_LIMIT: usize = 1000;
/// Size at which a page ends. A response holds at most this size plus one report in memory.
const PAGE_BYTES: usize = 4 << 20;

/// A stored report.
#[derive(ToSchema)]
#[expect(dead_code, reason = "documents the output of `write`")]
struct PastReport {
    /// The ID: the value for `since`, and the `ETag` of the latest report.
    #[schema(example = "1763717400412345")]
    id: String,
    /// Median of the persons in the reports of the 5 s up to this one, as far as this page has
    /// them.
    #[schema(example = 3)]
    persons: usize,
    /// In 90 % of frames, the true number is at least this one.
    #[schema(example = 2)]
    persons_low: usize,
    /// In 90 % of frames, the true number is at most this one.
    #[schema(example = 5)]
    persons_high: usize,
    /// The report.
    report: Report,
}

/// List past reports
///
/// Returns the stored reports of a camera, oldest first. A page ends after `limit` reports or 4
/// MiB. The ID of its last report is `since` of the next page. An empty page is the end.
#[utoipa::path(
    get, path = "/results/{camera}/history", tag = "results", operation_id = "list_past_results",
    params(
        ("camera" = String, Path, description = "The camera's name."),
        ("since" = Option<String>, Query, nullable = false, example = "2026-11-21T09:30:00Z",
            description = "Only what was reported later: than the report of this ID, or than this time \
                (RFC 3339)."),
        ("limit" = Option<u64>, Query, nullable = false, minimum = 1, maximum = 1000,
            description = "Largest number of reports; 100 by default."),
    ),
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses(
        (status = OK, description = "Oldest first.", body = Vec<PastReport>,
         headers(("Cache-Control" = String, description = "`no-cache`."))),
    )
)]
pub(in crate::api) async fn get_history(
    State(state): State<ApiState>,
    _reader: RequireRead,
    CameraAddress(camera): CameraAddress,
    uri: Uri,
) -> Result<impl IntoResponse, Problem> {
    let [since, limit] = parameters_named(&uri, ["since", "limit"])?;
    let since = since.map_or(Ok(ReportId::default()), |since| parse_since(&since))?;
    let limit = parse_limit(limit.as_deref())?;
    if state.results.latest(&camera).await?.is_none() {
        return Err(unknown(&camera));
    }
    let taught = state.references.number(&camera);
    let camera = Cameras::One(camera);
    let page = state.results.since(&camera, since, limit).await?;
    let content_type = [(CONTENT_TYPE, "application/json")];
    let cache = [(CACHE_CONTROL, "no-cache")];
    let persons = medians(&page, taught.as_deref());
    let body = write(page.iter().map(AsRef::as_ref).zip(persons));
    Ok((content_type, cache, body))
}

/// Writes a JSON array of the reports with their IDs and medians. The stored JSON of each report is
/// copied unchanged.
fn write<'a>(page: impl Iterator<Item = (&'a StoredReport, NumberWithBar)>) -> Bytes {
    let mut text = BytesMut::new();
    for (stored, NumberWithBar { persons, low, high }) in page {
        if text.len() > PAGE_BYTES {
            break;
        }
        text.put_u8(if text.is_empty() { b'[' } else { b',' });
        let start = format!(
            "{{\"id\":\"{}\",\"persons\":{persons},\"persons_low\":{low},\"persons_high\":{high},\
             \"report\":",
            stored.id
        );
        text.put_slice(start.as_bytes());
        text.put_slice(&stored.report.json);
        text.put_u8(b'}');
    }
    if text.is_empty() {
        text.put_u8(b'[');
    }
    text.put_u8(b']');
    text.freeze()
}

fn parse_since(text: &str) -> Result<ReportId, Problem> {
    let of_time = || text.parse::<Timestamp>().map(ReportId::at);
    text.parse().or_else(|_| of_time()).map_err(|_| {
        let rule = "the ID of a report, nor an RFC 3339 time with an offset, such as \
                    2026-11-21T09:30:00Z";
        ParameterError::is_not("since", text, rule).into()
    })
}

fn parse_limit(text: Option<&str>) -> Result<NonZeroUsize, Problem> {
    let Some(text) = text else {
        return Ok(NonZeroUsize::new(DEFAULT_LIMIT).unwrap_or(NonZeroUsize::MIN));
    };
    let limit = whole_number("limit", text, 1..=MAX_LIMIT)?;
    Ok(NonZeroUsize::new(limit).unwrap_or(NonZeroUsize::MIN))
}

/// Ten minutes, as for `timeout_millis`.
const MAX_WAIT_SECONDS: u64 = 600;

/// Get the latest report
///
/// `If-None-Match` with the `ETag` of a known report returns 304 while that is the latest. With
/// `wait`, the response waits for a newer report; 304 then means that none arrived in time.
#[utoipa::path(
    get, path = "/results/{camera}/latest", tag = "results", operation_id = "get_latest_result",
    params(
        ("camera" = String, Path, description = "The camera's name."),
        ("wait" = Option<u64>, Query, nullable = false, minimum = 0, maximum = 600,
            description = "Time to wait for a report other than that of `If-None-Match`, seconds; no \
                longer than the server's request timeout."),
        ("If-None-Match" = Option<String>, Header, nullable = false, pattern = r#"^(\*|"[!#-~]*")$"#,
            description = "The ETag of the known report."),
    ),
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses(
        (status = OK, description = "The report.", body = Report,
         headers(
            ("ETag" = String, description = "The report's ID."),
            ("Cache-Control" = String, description = "`no-cache`."),
         )),
        (status = NOT_MODIFIED, description = "There is no newer report."),
    )
)]
pub(in crate::api) async fn get_latest(
    State(state): State<ApiState>,
    _reader: RequireRead,
    deadline: Deadline,
    caller: Caller,
    CameraAddress(camera): CameraAddress,
    headers: HeaderMap,
    uri: Uri,
) -> Result<Response, Problem> {
    let [wait] = parameters_named(&uri, ["wait"])?;
    let seconds = wait.map_or(Ok(0), |wait| {
        whole_number("wait", &wait, 0..=MAX_WAIT_SECONDS)
    })?;
    let wait = Duration::from_secs(seconds);
    let report = if wait.is_zero() {
        state.results.latest(&camera).await?
    } else {
        let limit = deadline.within(Some(wait), "wait");
        let report = wait_for_newer(&state, &caller, &camera, &headers, limit).await?;
        // The key may have been removed during the wait.
        RequireRead::check_again(&state, &headers)?;
        report
    };
    let report = report.ok_or_else(|| unknown(&camera))?;
    let id = report.id.to_string();
    let content_type = [(CONTENT_TYPE, "application/json")];
    let answer = || (content_type, report.report.json.clone());
    let about = revalidated(entity_tag(&id));
    Ok(unless_known(&headers, &id, about, answer)?)
}

/// Returns the first report that the client does not have, or the latest one if none arrives in
/// time.
async fn wait_for_newer(
    state: &ApiState,
    caller: &Caller,
    camera: &str,
    headers: &HeaderMap,
    limit: Deadline,
) -> Result<Option<Arc<StoredReport>>, Problem> {
    // Subscribes before the first read, so no report is missed in between.
    let cameras = Cameras::One(camera.to_owned());
    let mut listening = state.results.listen(&caller.client, cameras).await?;
    let mut report = state.results.latest(camera).await?;
    let is_new = |report: &StoredReport| {
        let known = is_unmodified(headers, &report.id.to_string());
        known.map(|known| !known)
    };
    while !report.as_deref().map_or(Ok(false), is_new)?
        && let Ok(Some(notified)) = timeout_at(limit.at(), listening.next()).await
    {
        // A notification may be older than the report that was read.
        if report.as_ref().is_none_or(|now| notified.id > now.id) {
            report = Some(notified);
        }
    }
    Ok(report)
}

/// Get the latest image
///
/// Returns the frame of the latest report as JPEG: upright, with the masks of the calibration, with
/// boxes or the layers in `draw`. Images are stored only for the cameras in the setting
/// `results.images`. `If-None-Match` with the `ETag` of a known image returns 304 while that is
/// the latest.
#[utoipa::path(
    get, path = "/results/{camera}/latest.jpg", tag = "results", operation_id = "get_latest_image",
    params(
        ("camera" = String, Path, description = "The camera's name."),
        AnnotationQuery,
        ("If-None-Match" = Option<String>, Header, nullable = false, pattern = r#"^(\*|"[!#-~]*")$"#,
            description = "The ETag of the known image."),
    ),
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses(
        (status = OK, description = "The annotated image.", content((inline(RawBytes) = "image/jpeg")),
         headers(
            ("ETag" = String, description = "The ID of the report of the image."),
            ("Cache-Control" = String, description = "`private, no-cache`."),
         )),
        (status = NOT_MODIFIED, description = "There is no newer image."),
    )
)]
pub(in crate::api) async fn get_latest_image(
    State(state): State<ApiState>,
    _reader: RequireRead,
    deadline: Deadline,
    caller: Caller,
    CameraAddress(camera): CameraAddress,
    headers: HeaderMap,
    uri: Uri,
) -> Result<Response, Problem> {
    let options = AnnotationOptions::parse(pairs(&query_parameters(&uri)?))?;
    let latest = state.results.latest(&camera).await?;
    let latest = latest.ok_or_else(|| unknown(&camera))?.id;
    // A client that has the latest image needs no other, so the image is not fetched from Redis.
    if is_unmodified(&headers, &latest.to_string())? {
        return Ok((StatusCode::NOT_MODIFIED, private(&latest.to_string())).into_response());
    }
    let kept = state.results.image(&camera).await?;
    let kept = kept.ok_or_else(|| none_kept(&camera))?;
    let id = kept.id.to_string();
    let drawing = state.workers.run(caller.ticket(), move |withdrawn| {
        kept.frame.annotated(&options, &|| withdrawn.is_cancelled())
    });
    let drawn = deadline
        .wait("the image was not drawn", "send fewer requests", drawing)
        .await?;
    let image = Bytes::from(drawn.map_err(|error| undrawn(&camera, error))?);
    Ok((private(&id), [(CONTENT_TYPE, "image/jpeg")], image).into_response())
}

/// The stored data may be from another server or another program.
fn undrawn(camera: &str, error: StoredFrameError) -> Problem {
    if !matches!(
        error,
        StoredFrameError::Sketch(_) | StoredFrameError::Frame(_)
    ) {
        return Problem::internal(error);
    }
    let camera = Quoted(camera);
    let error = one_line(&error);
    let detail = format!(
        "the stored image of the camera {camera} cannot be used ({error}): the next frame of the \
         camera replaces it"
    );
    Problem::new(ProblemKind::ImageNotKept, detail)
}

fn none_kept(camera: &str) -> Problem {
    let camera = Quoted(camera);
    let detail = format!(
        "there is no image of the camera {camera}: images are stored from the next frame on, for the cameras in \
         the setting results.images (* for all) or with keep_image, for at most results.max_images cameras"
    );
    Problem::new(ProblemKind::ImageNotKept, detail)
}
