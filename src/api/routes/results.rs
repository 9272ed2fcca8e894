//! Stored reports, for dashboards: the latest one of each camera, earlier ones, and a stream of new
//! ones.

mod address;
pub(in crate::api) mod delete;
pub(in crate::api) mod events;
mod feed;
pub(in crate::api) mod history;
pub(in crate::api) mod latest;
pub(in crate::api) mod latest_image;
mod row;

use axum::{
    Json,
    extract::State,
    http::{
        HeaderMap, HeaderValue, StatusCode,
        header::{CACHE_CONTROL, ETAG},
    },
    response::{IntoResponse, Response},
};
use jiff::Timestamp;
use lookdown_calibration::revision::revision_of;
use lookdown_common::text::Quoted;
use lookdown_http::entity_tags::{is_unmodified, weak_entity_tag};

use self::row::CameraRow;
use crate::{
    api::{
        ApiState,
        http::problem::{Problem, ProblemKind},
        require_scope::RequireRead,
    },
    results::{ListenError, Unreachable},
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
        let headline = state.headline(report).await?;
        rows.push(CameraRow::at(report, headline, now));
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
