//! The counts of an answer, as JSON and CSV.

use std::{collections::BTreeMap, fmt::Write as _};

use jiff::Timestamp;
use serde::Serialize;
use utoipa::{
    ToSchema,
    openapi::{Object, ObjectBuilder, OneOfBuilder, Ref, RefOr, Schema, Type},
};

/// The counts of a camera or a site.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct Counts {
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
pub(super) struct StepCounts {
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
    pub(super) lines: Option<BTreeMap<String, BTreeMap<String, Option<u64>>>>,
    /// Counts by zone; absent for a site.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(schema_with = zones_schema)]
    pub(super) zones: Option<BTreeMap<String, Option<ZoneCounts>>>,
}

/// Persons of a step.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct PersonCounts {
    pub(super) mean: f64,
    /// In 90 % of rooms, the true mean is at least this one.
    pub(super) mean_low: f64,
    /// In 90 % of rooms, the true mean is at most this one.
    pub(super) mean_high: f64,
    pub(super) max: u64,
}

/// Counts of a zone in a step.
#[derive(Debug, Serialize, ToSchema)]
pub(in crate::http) struct ZoneCounts {
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
pub(super) fn csv(counts: &Counts) -> String {
    let mut text = "from,to,known_seconds,slow_seconds,persons_mean,persons_mean_low,persons_mean_high,persons_max".to_owned();
    let first = counts.steps.first();
    let lines = first.and_then(|step| step.lines.as_ref());
    for (line, directions) in lines.into_iter().flatten() {
        for direction in directions.keys() {
            let _ = write!(text, ",line.{line}.{direction}");
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
        for directions in step.lines.iter().flat_map(BTreeMap::values) {
            for crossings in directions.values() {
                cell(&mut text, *crossings);
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
