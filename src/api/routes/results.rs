//! Stored reports, for dashboards: the latest one of each camera, earlier ones, and a stream of new
//! ones.

pub(in crate::api) mod events;
pub(in crate::api) mod history;
pub(in crate::api) mod latest;

use axum::{
    Json,
    extract::{FromRequestParts, Path, State},
    http::{
        HeaderMap, HeaderValue, StatusCode,
        header::{CACHE_CONTROL, ETAG},
        request::Parts,
    },
    response::{IntoResponse, Response},
};
use jiff::Timestamp;
use lookdown_calibration::revision::revision_of;
use lookdown_common::text::Quoted;
use lookdown_http::entity_tags::{is_unmodified, weak_entity_tag};
use serde::Serialize;
use utoipa::ToSchema;

use super::counts;
use crate::{
    api::{
        ApiState,
        http::problem::{Problem, ProblemKind},
        require_scope::{RequireAdmin, RequireRead},
    },
    results::{Headline, ListenError, StoredReport, Unreachable},
};

/// Clients may cache the response, but must revalidate it before use.
const NO_CACHE: HeaderValue = HeaderValue::from_static("no-cache");

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
    let about = [(ETAG, weak_entity_tag(&tag)), (CACHE_CONTROL, NO_CACHE)];
    if is_unmodified(&headers, &tag)? {
        return Ok((StatusCode::NOT_MODIFIED, about).into_response());
    }
    Ok((about, Json(rows)).into_response())
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
