//! Counts per step as JSON and CSV, and their removal.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Write as _,
};

use axum::{
    Json,
    body::to_bytes,
    extract::{Path, Query, State, rejection::QueryRejection},
    http::{
        HeaderMap, StatusCode,
        header::{ACCEPT, CONTENT_TYPE},
    },
    response::{IntoResponse, Response},
};
use jiff::Timestamp;
use lookdown_calibration::revision::revision_of;
use lookdown_common::text::shortened;
use lookdown_http::{
    entity_tags::{entity_tag, revalidated, unless_known},
    problem::Problem,
};
use lookdown_tracking::taught::{CrossingRatio, default_bar};
use serde::{Deserialize, Serialize};
use utoipa::{
    IntoParams, ToSchema,
    openapi::{Object, ObjectBuilder, OneOfBuilder, Ref, RefOr, Schema, Type},
};

use super::{
    reference_crossings::{Ratios, ratios},
    shared::{Shared, blocking, check_known, query, stored, unusable_query},
    time::TimeParameters,
};
use crate::{
    definition::CameraDefinition,
    now::time_of,
    store::{Span, Step},
    sums::{MINUTE_MS, Owner, TimeSpan},
};

/// Most values of an answer: steps times directions of lines and zones. An answer has 12 MB at
/// most.
pub(crate) const MAX_VALUES: usize = 100_000;

/// Crossings by line and direction; `None` for unknown ones.
type Lines = BTreeMap<String, BTreeMap<String, Option<u64>>>;

/// The lines with their directions, and the zones.
type Names = (BTreeSet<(String, String)>, BTreeSet<String>);

/// Get the counts of a camera
///
/// `If-None-Match` with the `ETag` of known counts returns 304 until they change.
#[utoipa::path(
    get, path = "/counts/{camera}", tag = "counts", operation_id = "get_camera_counts",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    params(("camera" = String, Path, description = "The name of the camera."), TimeParameters,
        ("If-None-Match" = Option<String>, Header, nullable = false, pattern = r#"^(\*|"[!#-~]*")$"#,
            description = "The ETag of the known counts.")),
    responses(
        (status = OK, description = "Counts per step. Unknown counts are null.",
            content((Counts = "application/json"), (String = "text/csv")),
            headers(("ETag" = String, description = "It changes with the counts."))),
        (status = NOT_MODIFIED, description = "The counts are the same."),
    )
)]
pub(super) async fn camera_counts(
    State(api): State<Shared>,
    Path(camera): Path<String>,
    parameters: Result<Query<TimeParameters>, QueryRejection>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    answer(&api, Owner::Camera(camera), parameters, &headers).await
}

/// Get the counts of a site
///
/// `If-None-Match` with the `ETag` of known counts returns 304 until they change.
#[utoipa::path(
    get, path = "/sites/{site}", tag = "sites", operation_id = "get_site_counts",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    params(("site" = String, Path, description = "The name of the site."), TimeParameters,
        ("If-None-Match" = Option<String>, Header, nullable = false, pattern = r#"^(\*|"[!#-~]*")$"#,
            description = "The ETag of the known counts.")),
    responses(
        (status = OK, description = "Counts per step. Unknown counts are null.",
            content((Counts = "application/json"), (String = "text/csv")),
            headers(("ETag" = String, description = "It changes with the counts."))),
        (status = NOT_MODIFIED, description = "The counts are the same."),
    )
)]
pub(super) async fn site_counts(
    State(api): State<Shared>,
    Path(site): Path<String>,
    parameters: Result<Query<TimeParameters>, QueryRejection>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    answer(&api, Owner::Site(site), parameters, &headers).await
}

async fn answer(
    api: &Shared,
    owner: Owner,
    parameters: Result<Query<TimeParameters>, QueryRejection>,
    headers: &HeaderMap,
) -> Result<Response, Problem> {
    let Query(parameters) = parameters.map_err(|refused| unusable_query(&refused))?;
    let span = parameters.span()?;
    let is_csv = match parameters.format.as_deref() {
        Some("csv") => true,
        Some("json") => false,
        None => headers
            .get(ACCEPT)
            .is_some_and(|accept| accept.as_bytes().starts_with(b"text/csv")),
        Some(other) => {
            let fault = format!("{:?} is not a format: give json or csv", shortened(other));
            return Err(Problem::for_parameter("format", &fault));
        }
    };
    check_known(api, &owner).await?;
    let names = current_names(api, &owner);
    let store = api.store.clone();
    let response = blocking(move || {
        let sums = stored(store.steps(&owner, span, MAX_VALUES))?.ok_or_else(too_large)?;
        let ratios = match &owner {
            Owner::Camera(camera) => ratios(&stored(store.reference_crossings(camera))?),
            Owner::Site(_) => Ratios::default(),
        };
        let counts = counts(owner, span, &sums, (names, &ratios)).ok_or_else(too_large)?;
        if !is_csv {
            return Ok(Json(counts).into_response());
        }
        let content_type = [(CONTENT_TYPE, "text/csv; charset=utf-8; header=present")];
        Ok((content_type, csv(&counts)).into_response())
    })
    .await?;
    let (parts, body) = response.into_parts();
    let body = to_bytes(body, usize::MAX).await;
    let body = body.map_err(|_| Problem::internal())?;
    let revision = revision_of(&body);
    let about = revalidated(entity_tag(&revision));
    unless_known(headers, &revision, about, || (parts, body))
}

fn too_large() -> Problem {
    Problem::for_parameter(
        "step",
        "the steps of this time have too many values: give a longer step, or a shorter time",
    )
}

/// Returns the lines and zones that are counted now: a step without any has the count 0.
fn current_names(api: &Shared, owner: &Owner) -> Names {
    let Owner::Camera(camera) = owner else {
        return Names::default();
    };
    names(api.counter.lock().definition(camera).as_deref())
}

fn names(definition: Option<&CameraDefinition>) -> Names {
    let Some(definition) = definition else {
        return Names::default();
    };
    let directions = definition.lines.iter().zip(&definition.directions);
    let lines = directions.flat_map(|(line, directions)| {
        let pairs = directions.iter();
        pairs.map(|direction| (line.name.clone(), direction.clone()))
    });
    let zones = definition.zones.iter().map(|zone| zone.name.clone());
    (lines.collect(), zones.collect())
}

/// Returns the counts of a time as CSV, or `None` if there are too many.
pub(crate) fn table(
    owner: Owner,
    span: Span,
    sums: &BTreeMap<i64, Step>,
    definition: Option<&CameraDefinition>,
) -> Option<String> {
    let about = (names(definition), &Ratios::default());
    Some(csv(&counts(owner, span, sums, about)?))
}

/// Returns the counts, or `None` if there are too many.
fn counts(
    owner: Owner,
    span: Span,
    sums: &BTreeMap<i64, Step>,
    ((mut lines, mut zones), ratios): (Names, &Ratios),
) -> Option<Counts> {
    for step in sums.values() {
        lines.extend(step.crossings.keys().cloned());
        zones.extend(step.zones.keys().cloned());
    }
    let (time, step_ms) = (span.time(), span.step_minutes * MINUTE_MS);
    let count = (time.to_ms - time.from_ms + step_ms - 1) / step_ms;
    let columns = 1 + 4 * lines.len() + zones.len();
    let values = usize::try_from(count).ok()?.saturating_mul(columns);
    if values > MAX_VALUES {
        return None;
    }
    let nothing = Step::default();
    let steps = (0..count).map(|number| {
        let from_ms = time.from_ms + number * step_ms;
        let to_ms = (from_ms + step_ms).min(time.to_ms);
        let time = TimeSpan { from_ms, to_ms };
        let step = sums.get(&number).unwrap_or(&nothing);
        step_counts(step, time, (&lines, &zones, ratios), &owner)
    });
    Some(Counts {
        from: time_of(time.from_ms),
        to: time_of(time.to_ms),
        step_seconds: span.step_minutes * 60,
        steps: steps.collect(),
        camera: match &owner {
            Owner::Camera(name) => Some(name.clone()),
            Owner::Site(_) => None,
        },
        site: match owner {
            Owner::Site(name) => Some(name),
            Owner::Camera(_) => None,
        },
    })
}

fn step_counts(
    step: &Step,
    time: TimeSpan,
    (lines, zones, ratios): (&BTreeSet<(String, String)>, &BTreeSet<String>, &Ratios),
    owner: &Owner,
) -> StepCounts {
    let known_ms = step.presence.known_ms;
    let is_known = known_ms > 0;
    let mean = ratio(step.presence.person_ms, known_ms);
    let [mean_low, mean_high] = match step.presence.bar_ms {
        Some(bar_ms) => bar_ms.map(|end_ms| ratio(end_ms, known_ms)),
        None => default_bar(mean),
    };
    let is_camera = matches!(owner, Owner::Camera(_));
    let untaught = CrossingRatio::new(&[]);
    let mut counted = [const { Lines::new() }; 4];
    for (line, direction) in lines {
        let crossings = step.crossings.get(&(line.clone(), direction.clone()));
        let crossings = crossings.copied().or(is_known.then_some(0));
        let number = crossings.map(|count| ratios.get(line).unwrap_or(&untaught).number(count));
        let estimated = number.map(|number| [number.persons, number.low, number.high]);
        let [number, low, high] =
            estimated.map_or([None; 3], |ends| ends.map(|end| Some(end as u64)));
        for (lines, count) in counted.iter_mut().zip([crossings, number, low, high]) {
            let directions = lines.entry(line.clone()).or_default();
            directions.insert(direction.clone(), count);
        }
    }
    let [lines, lines_estimated, lines_low, lines_high] =
        counted.map(|lines| is_camera.then_some(lines));
    let zone_counts = zones.iter().map(|zone| {
        let sum = step.zones.get(zone).copied();
        let sum = sum.or(is_known.then(Default::default));
        let counts = sum.map(|sum| ZoneCounts {
            entries: sum.entries,
            mean: thousandths(ratio(sum.person_ms, known_ms)),
            max: sum.most,
            visits: sum.visits,
            dwell_seconds: (sum.visits > 0)
                .then(|| thousandths(ratio(sum.visit_ms, sum.visits) / 1000.0)),
        });
        (zone.clone(), counts)
    });
    StepCounts {
        from: time_of(time.from_ms),
        to: time_of(time.to_ms),
        known_seconds: ratio(known_ms, 1000),
        slow_seconds: is_camera.then(|| ratio(step.slow_ms, 1000)),
        persons: is_known.then(|| PersonCounts {
            mean: thousandths(mean),
            mean_low: thousandths(mean_low),
            mean_high: thousandths(mean_high),
            max: step.presence.most,
        }),
        zones: is_camera.then(|| zone_counts.collect()),
        lines,
        lines_estimated,
        lines_low,
        lines_high,
    }
}

fn ratio(value: u64, of: u64) -> f64 {
    if of == 0 {
        0.0
    } else {
        value as f64 / of as f64
    }
}

fn thousandths(value: f64) -> f64 {
    (value * 1000.0).round() / 1000.0
}

/// The counts of a camera or a site.
#[derive(Debug, Serialize, ToSchema)]
struct Counts {
    /// The camera; absent for a site.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub(super) camera: Option<String>,
    /// The site; absent for a camera.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub(super) site: Option<String>,
    pub(super) from: Timestamp,
    pub(super) to: Timestamp,
    pub(super) step_seconds: i64,
    pub(super) steps: Vec<StepCounts>,
}

/// The counts of a step. Unknown counts are null.
#[derive(Debug, Serialize, ToSchema)]
struct StepCounts {
    pub(super) from: Timestamp,
    pub(super) to: Timestamp,
    /// Seconds of the step in which reports arrived.
    pub(super) known_seconds: f64,
    /// Seconds of those with fewer frames than lines need, so that crossings may be missed; absent
    /// for a site.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub(super) slow_seconds: Option<f64>,
    pub(super) persons: Option<PersonCounts>,
    /// Crossings by line and direction; absent for a site.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub(super) lines: Option<Lines>,
    /// The true crossings, estimated with those that people counted in some hours; absent for a
    /// site.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    lines_estimated: Option<Lines>,
    /// In 90 % of steps, there were at least so many true crossings; absent for a site.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    lines_low: Option<Lines>,
    /// In 90 % of steps, there were at most so many; absent for a site.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    lines_high: Option<Lines>,
    /// Counts by zone; absent for a site.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(schema_with = zones_schema)]
    pub(super) zones: Option<BTreeMap<String, Option<ZoneCounts>>>,
}

/// Persons of a step.
#[derive(Debug, Serialize, ToSchema)]
struct PersonCounts {
    pub(super) mean: f64,
    /// In 90 % of rooms, the true mean is at least this one.
    pub(super) mean_low: f64,
    /// In 90 % of rooms, the true mean is at most this one.
    pub(super) mean_high: f64,
    pub(super) max: u64,
}

/// Counts of a zone in a step.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct ZoneCounts {
    pub(super) entries: u64,
    pub(super) mean: f64,
    pub(super) max: u64,
    /// Visits that ended in the step, and their mean duration.
    pub(super) visits: u64,
    pub(super) dwell_seconds: Option<f64>,
}

/// Describes counts or null by zone, which the derived schema cannot.
fn zones_schema() -> Object {
    let counts = OneOfBuilder::new()
        .item(ObjectBuilder::new().schema_type(Type::Null))
        .item(Ref::from_schema_name(ZoneCounts::name()));
    ObjectBuilder::new()
        .description(Some("Counts by zone; absent for a site."))
        .additional_properties(Some(RefOr::T(Schema::from(counts))))
        .build()
}

/// Writes the counts as a table. Unknown counts are empty cells.
fn csv(counts: &Counts) -> String {
    let mut text = "from,to,known_seconds,slow_seconds,persons_mean,persons_mean_low,persons_mean_high,persons_max".to_owned();
    let first = counts.steps.first();
    let lines = first.and_then(|step| step.lines.as_ref());
    for (line, directions) in lines.into_iter().flatten() {
        for direction in directions.keys() {
            for column in ["", ".estimated", ".low", ".high"] {
                let _ = write!(text, ",line.{line}.{direction}{column}");
            }
        }
    }
    let zones = first.and_then(|step| step.zones.as_ref());
    for zone in zones.into_iter().flat_map(BTreeMap::keys) {
        for column in ["entries", "mean", "max", "visits", "dwell_seconds"] {
            let _ = write!(text, ",zone.{zone}.{column}");
        }
    }
    text.push_str("\r\n");
    for step in &counts.steps {
        let _ = write!(text, "{},{},{}", step.from, step.to, step.known_seconds);
        cell(&mut text, step.slow_seconds);
        let persons = step.persons.as_ref();
        cell(&mut text, persons.map(|persons| persons.mean));
        cell(&mut text, persons.map(|persons| persons.mean_low));
        cell(&mut text, persons.map(|persons| persons.mean_high));
        cell(&mut text, persons.map(|persons| persons.max));
        let [estimated, low, high] = [&step.lines_estimated, &step.lines_low, &step.lines_high];
        for (line, directions) in step.lines.iter().flatten() {
            for (direction, crossings) in directions {
                cell(&mut text, *crossings);
                for lines in [estimated, low, high] {
                    let count = lines.as_ref().and_then(|lines| lines[line][direction]);
                    cell(&mut text, count);
                }
            }
        }
        for zone in step.zones.iter().flat_map(BTreeMap::values) {
            let zone = zone.as_ref();
            cell(&mut text, zone.map(|zone| zone.entries));
            cell(&mut text, zone.map(|zone| zone.mean));
            cell(&mut text, zone.map(|zone| zone.max));
            cell(&mut text, zone.map(|zone| zone.visits));
            cell(&mut text, zone.and_then(|zone| zone.dwell_seconds));
        }
        text.push_str("\r\n");
    }
    text
}

fn cell(text: &mut String, value: Option<impl std::fmt::Display>) {
    text.push(',');
    if let Some(value) = value {
        let _ = write!(text, "{value}");
    }
}

/// The parameters of a removal.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct RemovalParameters {
    /// `true` keeps the stored counts: the camera only leaves the list, the metrics and MQTT.
    #[serde(default)]
    keep_history: bool,
}

/// Delete the counts of a camera
///
/// Deletes its history, its tracks and its furniture. A camera that still sends frames begins
/// again with its next report.
#[utoipa::path(
    delete, path = "/counts/{camera}", tag = "counts", operation_id = "delete_camera_counts",
    security((), ("bearer" = ["admin"]), ("api_key" = ["admin"])),
    params(("camera" = String, Path, description = "The name of the camera."), RemovalParameters),
    responses((status = NO_CONTENT, description = "The counts are deleted."))
)]
pub(super) async fn delete(
    State(api): State<Shared>,
    Path(camera): Path<String>,
    parameters: Result<Query<RemovalParameters>, QueryRejection>,
) -> Result<StatusCode, Problem> {
    let Query(parameters) = parameters.map_err(|refused| unusable_query(&refused))?;
    let keeps = parameters.keep_history;
    let is_followed = api.counter.lock().remove(&camera, keeps);
    if !is_followed {
        check_known(&api, &Owner::Camera(camera.clone())).await?;
    }
    if !keeps {
        query(&api, move |store| store.remove(&camera)).await?;
    }
    Ok(StatusCode::NO_CONTENT)
}

#[cfg(test)]
mod tests;
