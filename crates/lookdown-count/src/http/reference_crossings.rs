//! The crossings of an hour that a person counted: they teach how many are missed or invented.

use std::collections::BTreeMap;

use axum::{
    Json,
    extract::{Path, Query, State, rejection::QueryRejection},
    http::StatusCode,
};
use jiff::Timestamp;
use lookdown_common::text::one_line;
use lookdown_http::problem::Problem;
use lookdown_tracking::taught::{CrossingRatio, ReferenceCrossings};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::{
    shared::{Shared, check_known, not_found, query, unusable_query},
    time::timestamp,
};
use crate::{
    store::{HOUR_MINUTES, ReferenceHour, Span},
    sums::{LineDirection, MINUTE_MS, Owner},
};

/// Least time of an hour with reports, nine tenths: the crossings of the rest are not counted.
const LEAST_KNOWN_MS: u64 = 54 * 60_000;
/// Most crossings of an hour: one each .36 s.
const MAX_CROSSINGS: u64 = 10_000;

/// The ratios of true to counted crossings by line.
pub(super) type Ratios = BTreeMap<String, CrossingRatio>;

/// The crossings of a line in a direction in an hour.
#[derive(Serialize, ToSchema)]
pub(super) struct ReferenceCrossingCount {
    /// The begin of the hour.
    from: Timestamp,
    line: String,
    direction: String,
    /// The crossings that a person counted.
    crossings: u64,
    /// The crossings that the camera counted.
    counted: u64,
}

impl From<ReferenceHour> for ReferenceCrossingCount {
    fn from(hour: ReferenceHour) -> Self {
        Self {
            from: hour.from,
            line: hour.line,
            direction: hour.direction,
            crossings: hour.crossings,
            counted: hour.counted,
        }
    }
}

/// The reference crossings of a camera, and what they teach.
#[derive(Serialize, ToSchema)]
pub(super) struct ReferenceCrossingList {
    /// By hour, line and direction.
    crossings: Vec<ReferenceCrossingCount>,
    /// The ratio of true to counted crossings by line.
    ratios: BTreeMap<String, f64>,
}

/// List reference crossings
///
/// People counted these crossings. Those of a line, in both directions, teach the ratio of its true
/// to its counted crossings, and the error bar.
#[utoipa::path(
    get, path = "/counts/{camera}/reference-crossings", tag = "counts",
    operation_id = "list_reference_crossings",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    params(("camera" = String, Path, description = "The name of the camera.")),
    responses((status = OK, description = "Oldest first.", body = ReferenceCrossingList))
)]
pub(super) async fn list(
    State(api): State<Shared>,
    Path(camera): Path<String>,
) -> Result<Json<ReferenceCrossingList>, Problem> {
    check_known(&api, &Owner::Camera(camera.clone())).await?;
    let hours = query(&api, move |store| store.reference_crossings(&camera)).await?;
    let ratios = ratios(&hours).into_iter();
    Ok(Json(ReferenceCrossingList {
        ratios: ratios.map(|(line, of)| (line, of.ratio)).collect(),
        crossings: hours
            .into_iter()
            .map(ReferenceCrossingCount::from)
            .collect(),
    }))
}

/// Returns the ratios of lines with reference crossings.
pub(super) fn ratios(hours: &[ReferenceHour]) -> Ratios {
    let mut times = BTreeMap::<_, BTreeMap<Timestamp, ReferenceCrossings>>::new();
    for hour in hours {
        let of_line = times.entry(hour.line.clone()).or_default();
        let time = of_line.entry(hour.from).or_default();
        time.given += hour.crossings;
        time.counted += hour.counted;
    }
    let times = times.into_iter().map(|(line, times)| {
        let times: Vec<_> = times.into_values().collect();
        (line, CrossingRatio::new(&times))
    });
    times.collect()
}

/// The crossings that a person counted.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct GivenCrossings {
    /// The name of the line.
    line: String,
    /// The name of the direction.
    direction: String,
    /// The crossings of the hour, up to 10000.
    crossings: u64,
}

/// Set reference crossings
///
/// Stores how many people crossed a line in a direction in the hour from this time on, as a person
/// counted them. The camera must have been counted for nine tenths of it. Of 61 hours, the oldest
/// makes room.
#[utoipa::path(
    put, path = "/counts/{camera}/reference-crossings/{from}", tag = "counts",
    operation_id = "put_reference_crossings",
    security((), ("bearer" = ["admin"]), ("api_key" = ["admin"])),
    params(
        ("camera" = String, Path, description = "The name of the camera."),
        ("from" = String, Path, format = DateTime, description = "The begin of the hour, in whole minutes."),
        GivenCrossings,
    ),
    responses((status = NO_CONTENT, description = "The crossings are stored."))
)]
pub(super) async fn put(
    State(api): State<Shared>,
    Path((camera, from)): Path<(String, String)>,
    given: Result<Query<GivenCrossings>, QueryRejection>,
) -> Result<StatusCode, Problem> {
    let owner = Owner::Camera(camera.clone());
    check_known(&api, &owner).await?;
    let Query(given) = given.map_err(|refused| unusable_query(&refused))?;
    let minute = minute(&from)?;
    let span = Span {
        from_minute: minute,
        to_minute: minute + HOUR_MINUTES,
        step_minutes: HOUR_MINUTES,
    };
    if given.crossings > MAX_CROSSINGS {
        let fault = format!(
            "{} is more than {MAX_CROSSINGS}: give those of one hour",
            given.crossings
        );
        return Err(Problem::for_parameter("crossings", &fault));
    }
    let definition = api.counter.lock().definition(&camera);
    let mut lines = definition
        .iter()
        .flat_map(|camera| camera.lines.iter().zip(&camera.directions));
    if !lines
        .any(|(line, directions)| line.name == given.line && directions.contains(&given.direction))
    {
        let [camera, line, direction] = [&camera, &given.line, &given.direction].map(one_line);
        let fault = format!(
            "{camera} has no line {line} with the direction {direction}: GET /counts/{camera} has all"
        );
        return Err(Problem::for_parameter("line", &fault));
    }
    let known = query(&api, move |store| store.steps(&owner, span, usize::MAX)).await?;
    let known_ms = known.and_then(|steps| Some(steps.get(&0)?.presence.known_ms));
    if known_ms.unwrap_or_default() < LEAST_KNOWN_MS {
        let fault = "the camera was not counted for nine tenths of this hour: give another one";
        return Err(Problem::for_parameter("from", fault));
    }
    let of = LineDirection {
        camera,
        line: given.line,
        direction: given.direction,
    };
    query(&api, move |store| {
        store.put_reference_crossings(&of, minute, given.crossings)
    })
    .await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Delete reference crossings
///
/// Deletes those of all lines in the hour from this time on.
#[utoipa::path(
    delete, path = "/counts/{camera}/reference-crossings/{from}", tag = "counts",
    operation_id = "delete_reference_crossings",
    security((), ("bearer" = ["admin"]), ("api_key" = ["admin"])),
    params(
        ("camera" = String, Path, description = "The name of the camera."),
        ("from" = String, Path, format = DateTime, description = "The begin of the hour."),
    ),
    responses((status = NO_CONTENT, description = "The reference crossings are deleted."))
)]
pub(super) async fn delete(
    State(api): State<Shared>,
    Path((camera, from)): Path<(String, String)>,
) -> Result<StatusCode, Problem> {
    let minute = minute(&from)?;
    let of = camera.clone();
    if query(&api, move |store| {
        store.remove_reference_crossings(&of, minute)
    })
    .await?
    {
        return Ok(StatusCode::NO_CONTENT);
    }
    let camera = one_line(&camera);
    Err(not_found(format!(
        "{camera} has no reference crossings from this time on: GET \
         /counts/{camera}/reference-crossings lists them"
    )))
}

/// Returns the minute at which an hour begins.
fn minute(from: &str) -> Result<i64, Problem> {
    let from_ms = timestamp("from", Some(from))?.unwrap_or_default();
    if from_ms % MINUTE_MS != 0 {
        return Err(Problem::for_parameter(
            "from",
            "an hour begins at a whole minute: leave out seconds",
        ));
    }
    Ok(from_ms / MINUTE_MS)
}
