//! Counts per step as CSV.

use std::{collections::BTreeMap, fmt::Write as _};

use super::Counts;

/// Writes the counts as a table. Unknown counts are empty cells.
pub(super) fn csv(counts: &Counts) -> String {
    let mut text = "from,to,known_seconds,slow_seconds,persons_mean,persons_max".to_owned();
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
