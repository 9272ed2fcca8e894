//! The numbers of persons that people gave for frames of a camera.

use std::num::NonZeroUsize;

use axum::{
    Json,
    extract::{Path, State},
    http::{StatusCode, header::CACHE_CONTROL},
    response::IntoResponse,
};
use jiff::{SignedDuration, Timestamp};
use lookdown_common::text::Quoted;
use lookdown_tracking::taught::{MAX_FRAMES, MIN_FRAMES};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::{CameraBody, stored_status};
use crate::{
    api::{
        ApiState,
        http::{
            deadline::{CAMERAS, Deadline},
            problem::{Problem, ProblemKind},
        },
        require_scope::{RequireAdmin, RequireRead},
    },
    reference_counts::{MAX_PERSONS, ReferenceCount, ReferenceError, good_moment},
    results::{Cameras, ReportId},
};

/// The number of persons in a frame.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "persons": 7 }))]
pub(in crate::api) struct GivenPersons {
    /// The number of persons that a person sees in the frame.
    #[schema(minimum = 0, maximum = 1000)]
    persons: u32,
}

/// The number of persons that a person gave for the frame of a report.
#[derive(Serialize, ToSchema)]
struct GivenCount {
    /// The ID of the report.
    #[schema(example = "1763717400412345")]
    report: String,
    /// The time of the report.
    #[schema(value_type = String, format = DateTime)]
    at: Timestamp,
    /// The number of persons.
    #[schema(example = 7)]
    persons: u32,
}

/// The reference counts of a camera.
#[derive(Serialize, ToSchema)]
pub(in crate::api) struct ReferenceCountList {
    /// Oldest first, at most 60. They count for 180 days.
    counts: Vec<GivenCount>,
    /// The number of reference counts from which on they teach the number of the camera.
    #[schema(example = 5)]
    counts_wanted: usize,
    /// The largest number of reference counts: a new one replaces the oldest.
    #[schema(example = 60)]
    counts_kept: usize,
    /// The mean score threshold of the camera; `null` with fewer reference counts.
    #[schema(example = 0.18)]
    score_threshold: Option<f64>,
    /// The reason why the number in the latest frame would teach much: `few`, `busy`, `empty`,
    /// `other_hour` or `unsure`; else `null`.
    #[schema(example = "busy")]
    moment: Option<&'static str>,
}

/// List reference counts
///
/// People gave these numbers of persons for frames. From five on, they teach the number of the
/// camera and its error bar.
#[utoipa::path(
    get, path = "/cameras/{camera}/reference-counts", tag = "cameras",
    operation_id = "list_reference_counts",
    params(("camera" = String, Path, description = "The name of the camera.", example = "hall")),
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses((status = OK, description = "The reference counts.", body = ReferenceCountList))
)]
pub(in crate::api) async fn list(
    State(state): State<ApiState>,
    _reader: RequireRead,
    Path(camera): Path<String>,
) -> Result<impl IntoResponse, Problem> {
    let latest = state.results.latest(&camera).await?;
    let counts = state.references.counts(&camera, Timestamp::now());
    if latest.is_none() && counts.is_empty() {
        return Err(unknown_camera(&camera));
    }
    let mut moment = None;
    if let Some(latest) = latest.filter(|latest| latest.report.scores.is_some()) {
        let number = state.headline(&latest).await?.number;
        moment = number.and_then(|number| good_moment(&counts, latest.id.time(), number));
    }
    let taught = state.references.number(&camera);
    let list = ReferenceCountList {
        counts: counts.into_iter().map(GivenCount::from).collect(),
        counts_wanted: MIN_FRAMES,
        counts_kept: MAX_FRAMES,
        score_threshold: taught.map(|taught| (taught.threshold() * 1000.0).round() / 1000.0),
        moment,
    };
    Ok(([(CACHE_CONTROL, "no-store")], Json(list)))
}

/// Set a reference count
///
/// Stores the number of persons that a person sees in the frame of a stored report, with its scores
/// and its time, and no image.
#[utoipa::path(
    put, path = "/cameras/{camera}/reference-counts/{report}", tag = "cameras",
    operation_id = "put_reference_count",
    params(("camera" = String, Path, description = "The name of the camera.", example = "hall"),
        ("report" = String, Path, description = "The ID of the report.", example = "1763717400412345")),
    request_body(content = GivenPersons, content_type = "application/json"),
    security((), ("bearer" = ["admin"]), ("api_key" = ["admin"])),
    responses(
        (status = CREATED, description = "The reference count is new."),
        (status = NO_CONTENT, description = "The reference count is replaced."),
    )
)]
pub(in crate::api) async fn put(
    State(state): State<ApiState>,
    _admin: RequireAdmin,
    deadline: Deadline,
    Path((camera, report)): Path<(String, String)>,
    CameraBody(GivenPersons { persons }): CameraBody<GivenPersons>,
) -> Result<StatusCode, Problem> {
    if persons > MAX_PERSONS {
        let fault = format!("{persons} is more than {MAX_PERSONS}: give the number of people");
        let kind = ProblemKind::InvalidParameter;
        return Err(Problem::for_parameter(kind, "persons", &fault));
    }
    if state.results.latest(&camera).await?.is_none() {
        return Err(unknown_camera(&camera));
    }
    let count = reference_count(&state, &camera, &report, persons).await?;
    let put = move || state.references.put(&camera, count, Timestamp::now());
    deadline.using(&CAMERAS, put).await.map(stored_status)
}

/// Delete a reference count
#[utoipa::path(
    delete, path = "/cameras/{camera}/reference-counts/{report}", tag = "cameras",
    operation_id = "delete_reference_count",
    params(("camera" = String, Path, description = "The name of the camera.", example = "hall"),
        ("report" = String, Path, description = "The ID of the report.", example = "1763717400412345")),
    security((), ("bearer" = ["admin"]), ("api_key" = ["admin"])),
    responses((status = NO_CONTENT, description = "The reference count is deleted."))
)]
pub(in crate::api) async fn delete(
    State(state): State<ApiState>,
    _admin: RequireAdmin,
    deadline: Deadline,
    Path((camera, report)): Path<(String, String)>,
) -> Result<StatusCode, Problem> {
    let delete = move || state.references.delete(&camera, &report, Timestamp::now());
    if deadline.using(&CAMERAS, delete).await? {
        return Ok(StatusCode::NO_CONTENT);
    }
    let detail = "the camera has no such reference count: GET its reference-counts lists them";
    Err(Problem::new(ProblemKind::NotFound, detail))
}

/// Returns the reference count of a stored report.
async fn reference_count(
    state: &ApiState,
    camera: &str,
    report: &str,
    persons: u32,
) -> Result<ReferenceCount, Problem> {
    let id = report.parse::<ReportId>().ok();
    let mut found = None;
    if let Some(id) = id {
        let before = ReportId::at(id.time() - SignedDuration::from_micros(1));
        let cameras = Cameras::One(camera.to_owned());
        let reports = state.results.since(&cameras, before, NonZeroUsize::MIN);
        found = reports.await?.into_iter().find(|stored| stored.id == id);
    }
    let Some(found) = found else {
        let report = Quoted(report);
        let detail = format!(
            "report: {report} is not stored: give the ID of a report in GET \
             /results/{{camera}}/history"
        );
        return Err(Problem::new(ProblemKind::NotFound, detail));
    };
    let Some(scores) = found.report.scores.clone() else {
        let fault = "the scores of reports in Redis are unknown: remove results.url, so that \
                     reports are stored in memory";
        let kind = ProblemKind::InvalidParameter;
        return Err(Problem::for_parameter(kind, "report", fault));
    };
    Ok(ReferenceCount {
        report: report.to_owned(),
        at: found.id.time(),
        persons,
        scores,
    })
}

fn unknown_camera(camera: &str) -> Problem {
    let camera = Quoted(camera);
    let detail = format!(
        "there is no report of the camera {camera}: GET /results lists the cameras with reports"
    );
    Problem::new(ProblemKind::UnknownCamera, detail)
}

impl From<ReferenceCount> for GivenCount {
    fn from(count: ReferenceCount) -> Self {
        Self {
            report: count.report,
            at: count.at,
            persons: count.persons,
        }
    }
}

impl From<ReferenceError> for Problem {
    fn from(error: ReferenceError) -> Self {
        match error {
            ReferenceError::Full => Self::new(ProblemKind::CameraConflict, error.to_string()),
            ReferenceError::Unwritable { .. } => Self::internal(error),
        }
    }
}
