//! Reports that are kept, for dashboards: the latest of each camera, those before it, and each as it
//! comes.

mod address;
pub(super) mod events;
mod feed;
pub(super) mod history;
pub(super) mod latest;
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
    openapi::ReadProblems,
    problem::{Problem, ProblemKind},
};
use crate::results::ListenError;

/// May be kept, but not shown before the server was asked whether it is still right.
const NO_CACHE: HeaderValue = HeaderValue::from_static("no-cache");
/// Most characters of a name that are repeated to its sender.
const MAX_SHOWN_CHARS: usize = 64;

/// Of which cameras are there reports?
///
/// With the age of each camera's latest report and how many persons are in it.
#[utoipa::path(
    get, path = "/results", tag = "results", operation_id = "list_results",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses((status = OK, description = "By name.", body = Vec<CameraRow>), ReadProblems)
)]
pub(super) async fn list(State(state): State<ApiState>, _reader: Reader) -> impl IntoResponse {
    let now = Timestamp::now();
    let latest = state.results.latest_of_all().await;
    let mut rows: Vec<_> = latest
        .iter()
        .map(|report| CameraRow::at(report, now))
        .collect();
    rows.sort_unstable_by(|one, other| one.camera.cmp(&other.camera));
    ([(CACHE_CONTROL, NO_CACHE)], Json(rows))
}

/// No report of that camera is kept.
fn unknown(camera: &str) -> Problem {
    let camera: String = camera.chars().take(MAX_SHOWN_CHARS).collect();
    let detail = format!(
        "no report of the camera {camera:?} is kept: GET /results lists the cameras, and a frame sent to \
         /detect with this name as the parameter camera makes it one of them"
    );
    Problem::new(ProblemKind::UnknownCamera, detail)
}

fn not_allowed(name: &str, value: &str, rule: &str) -> Problem {
    let value: String = value.chars().take(MAX_SHOWN_CHARS).collect();
    let detail = format!("{name}: {value:?} is not {rule}");
    Problem::new(ProblemKind::InvalidParameter, detail)
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
