//! Stored reports, for dashboards: the latest one of each camera, earlier ones, and a stream of new
//! ones.

mod address;
pub(in crate::api) mod delete;
pub(in crate::api) mod events;
mod feed;
pub(in crate::api) mod followed;
pub(in crate::api) mod history;
pub(in crate::api) mod latest;
pub(in crate::api) mod latest_image;
mod row;

use axum::{
    Json,
    extract::State,
    http::{HeaderValue, header::CACHE_CONTROL},
    response::IntoResponse,
};
use jiff::Timestamp;
use lookdown_common::text::Quoted;

use self::row::CameraRow;
use crate::{
    api::{
        ApiState,
        http::problem::{Problem, ProblemKind},
        require_scope::RequireRead,
    },
    results::{Headline, ListenError, Unreachable},
};

/// Clients may cache the response, but must revalidate it before use.
const NO_CACHE: HeaderValue = HeaderValue::from_static("no-cache");

/// List cameras with reports
///
/// Each entry has the age of the latest report and the number of persons there now.
#[utoipa::path(
    get, path = "/results", tag = "results", operation_id = "list_results",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses((status = OK, description = "By name.", body = Vec<CameraRow>))
)]
pub(in crate::api) async fn list(
    State(state): State<ApiState>,
    _reader: RequireRead,
) -> Result<impl IntoResponse, Problem> {
    let now = Timestamp::now();
    let own = state.options.companions.own_cameras();
    let latest = state.results.latest_of_all().await?;
    let mut rows = Vec::with_capacity(latest.len());
    for report in &latest {
        let headline = Headline::of(&*state.results, report, &own).await?;
        rows.push(CameraRow::at(report, headline, now));
    }
    rows.sort_unstable_by(|one, other| one.camera.cmp(&other.camera));
    Ok(([(CACHE_CONTROL, NO_CACHE)], Json(rows)))
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
