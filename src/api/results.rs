//! Reports that are kept, for dashboards: the latest of each camera, those before it, and each as it
//! comes.

mod address;
pub(super) mod events;
mod feed;
pub(super) mod history;
pub(super) mod latest;
pub(super) mod picture;
mod row;

use axum::{
    Json,
    extract::State,
    http::{HeaderValue, header::CACHE_CONTROL},
    response::IntoResponse,
};
use jiff::Timestamp;

use self::row::CameraRow;
use super::{
    ApiState,
    access::Reader,
    problem::{Problem, ProblemKind},
};
use crate::{
    quoted::Quoted,
    results::{ListenError, Unreachable},
};

/// May be kept, but not shown before the server was asked whether it is still right.
const NO_CACHE: HeaderValue = HeaderValue::from_static("no-cache");

/// Of which cameras are there reports?
///
/// With the age of each camera's latest report and how many persons are in it.
#[utoipa::path(
    get, path = "/results", tag = "results", operation_id = "list_results",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses((status = OK, description = "By name.", body = Vec<CameraRow>))
)]
pub(super) async fn list(
    State(state): State<ApiState>,
    _reader: Reader,
) -> Result<impl IntoResponse, Problem> {
    let now = Timestamp::now();
    let latest = state.results.latest_of_all().await?;
    let mut rows: Vec<_> = latest
        .iter()
        .map(|report| CameraRow::at(report, now))
        .collect();
    rows.sort_unstable_by(|one, other| one.camera.cmp(&other.camera));
    Ok(([(CACHE_CONTROL, NO_CACHE)], Json(rows)))
}

/// No report of that camera is kept.
fn unknown(camera: &str) -> Problem {
    let camera = Quoted(camera);
    let detail = format!(
        "no report of the camera {camera} is kept: GET /results lists the cameras, and a frame sent to \
         /detect with this name as the parameter camera makes it one of them"
    );
    Problem::new(ProblemKind::UnknownCamera, detail)
}

/// Why it does not answer is the operator's business, who finds it in the log and in `/readyz`.
impl From<Unreachable> for Problem {
    fn from(_: Unreachable) -> Self {
        let detail = "the place of the results does not answer now: try again; frames are looked at all the same";
        Self::new(ProblemKind::ResultsUnreachable, detail)
    }
}

impl From<ListenError> for Problem {
    fn from(error: ListenError) -> Self {
        match error {
            ListenError::Ended => Self::shutting_down(),
            ListenError::Full { .. } => {
                let detail = format!("{error}: ask without wait, or again in a while");
                Self::new(ProblemKind::TooManyListeners, detail)
            }
        }
    }
}
