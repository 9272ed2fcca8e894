//! Zones: occupancy, entries and dwell times.
//!
//! A person enters after a while inside and leaves after a while outside (the hold), so that a
//! track that trembles at the outline does not flap. Times are those of the first and last place
//! inside.

use std::collections::BTreeMap;

use lookdown_lens::geometry::Polygon;
use nalgebra::Point2;
use serde::{Deserialize, Serialize};

use crate::{Plane, TailPoint, Track, TrackId};

/// Most zones of a counter.
pub const MAX_ZONES: usize = 64;
/// Hold where none is set, seconds.
pub const DEFAULT_HOLD_S: f64 = 1.0;
/// Places in a row that change a person's side of the outline, whatever time they span.
const LEAST_PLACES: u32 = 2;

/// A named area.
#[derive(Clone, Debug, PartialEq)]
pub struct Zone {
    /// The name, unique within its counter.
    pub name: String,
    /// The plane of the area.
    pub plane: Plane,
    /// The area.
    pub area: Polygon,
}

/// An entry into a zone, or an exit from it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "lowercase")]
pub enum ZoneEvent {
    /// A person entered, or appeared inside.
    Entered {
        /// Index of the zone.
        zone: usize,
        /// Track of the person.
        track: TrackId,
        /// Time of the first place inside, seconds since the Unix epoch.
        at_s: f64,
    },
    /// A person left, or its track ended inside.
    Left {
        /// Index of the zone.
        zone: usize,
        /// Track of the person.
        track: TrackId,
        /// Time of the last place inside, seconds since the Unix epoch.
        at_s: f64,
        /// Time between the first and the last place inside, seconds.
        dwell_s: f64,
    },
}

/// Zones that cannot be counted.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ZoneError {
    /// Too many zones.
    #[error("there are {0} zones: give at most {MAX_ZONES}")]
    Count(usize),
    /// A hold that is not a time.
    #[error("the hold of the zones is {0} s: give a number of at least 0")]
    Hold(f64),
}

/// The zones over the tracks of one tracker.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ZoneCounter {
    /// The zones.
    pub zones: Vec<Zone>,
    hold_s: f64,
    /// The state to be stored with that of the tracker.
    pub state: ZoneState,
}

/// The part of a counter that must survive a restart together with the tracker.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ZoneState {
    /// The state of each track in each zone.
    tracks: BTreeMap<TrackId, Vec<Visit>>,
}

/// A track and a zone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Visit {
    /// Time of the last place, seconds since the Unix epoch.
    seen_s: Option<f64>,
    /// True between the entry and the exit.
    is_inside: bool,
    /// Time of the first place inside of this visit.
    since_s: f64,
    /// Time of the last place inside.
    inside_s: f64,
    /// Places in a row on the other side than `is_inside` says.
    places: u32,
}

impl ZoneCounter {
    /// Returns a counter of these zones with the hold in seconds.
    ///
    /// # Errors
    /// [`ZoneError`] for too many zones or a hold that is not a time.
    pub fn new(zones: Vec<Zone>, hold_s: f64) -> Result<Self, ZoneError> {
        Self::resumed(zones, hold_s, ZoneState::default())
    }

    /// Returns a counter of the zones that `state` was kept for.
    ///
    /// # Errors
    /// [`ZoneError`] for too many zones or a hold that is not a time.
    pub fn resumed(zones: Vec<Zone>, hold_s: f64, mut state: ZoneState) -> Result<Self, ZoneError> {
        if zones.len() > MAX_ZONES {
            return Err(ZoneError::Count(zones.len()));
        }
        if !(hold_s >= 0.0 && hold_s.is_finite()) {
            return Err(ZoneError::Hold(hold_s));
        }
        state.tracks.retain(|_, visits| visits.len() == zones.len());
        Ok(Self {
            zones,
            hold_s,
            state,
        })
    }

    /// Returns entries and exits since the last call. `tracks` are all confirmed tracks of the
    /// tracker, after each of its updates: a track that is gone leaves its zones.
    pub fn update<'a>(&mut self, tracks: impl IntoIterator<Item = &'a Track>) -> Vec<ZoneEvent> {
        let mut events = Vec::new();
        let mut states = BTreeMap::new();
        let mut before = std::mem::take(&mut self.state.tracks);
        for track in tracks {
            let known = before.remove(&track.id);
            let mut visits = known.unwrap_or_else(|| vec![Visit::default(); self.zones.len()]);
            for (zone, visit) in visits.iter_mut().enumerate() {
                let area = &self.zones[zone];
                for side in visit.advance(area, track.tail(), self.hold_s) {
                    events.push(side.event(zone, track.id));
                }
            }
            states.insert(track.id, visits);
        }
        for (&track, visits) in &before {
            let inside = visits
                .iter()
                .enumerate()
                .filter(|(_, visit)| visit.is_inside);
            events.extend(inside.map(|(zone, visit)| visit.left().event(zone, track)));
        }
        self.state.tracks = states;
        events
    }

    /// Returns the number of persons in each zone.
    pub fn occupancy(&self) -> Vec<usize> {
        let zones = 0..self.zones.len();
        zones.map(|zone| self.inside(zone).count()).collect()
    }

    fn inside(&self, zone: usize) -> impl Iterator<Item = &Visit> {
        let visits = self.state.tracks.values();
        visits.filter_map(move |visits| visits.get(zone).filter(|visit| visit.is_inside))
    }
}

/// A change of a visit.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Change {
    Entered { at_s: f64 },
    Left { at_s: f64, dwell_s: f64 },
}

impl Visit {
    /// Follows the new points of a track and returns the entries and exits that now hold.
    fn advance<'a>(
        &mut self,
        zone: &Zone,
        tail: impl Iterator<Item = &'a TailPoint>,
        hold_s: f64,
    ) -> Vec<Change> {
        let mut changes = Vec::new();
        for point in tail {
            let is_known = self.seen_s.is_some_and(|seen_s| point.at_s <= seen_s);
            let Some(place) = point.place(zone.plane).filter(|_| !is_known) else {
                continue;
            };
            self.seen_s = Some(point.at_s);
            let is_inside = zone.area.holds(Point2::from(place));
            changes.extend(self.see(is_inside, point.at_s, hold_s));
        }
        changes
    }

    /// Takes one place into account.
    fn see(&mut self, is_inside: bool, at_s: f64, hold_s: f64) -> Option<Change> {
        let is_other_side = is_inside != self.is_inside;
        self.places = if is_other_side { self.places + 1 } else { 0 };
        if is_inside {
            if is_other_side && self.places == 1 {
                self.since_s = at_s;
            }
            self.inside_s = at_s;
        }
        // The first place inside, or the last one inside.
        let changed_s = if is_inside {
            self.since_s
        } else {
            self.inside_s
        };
        if self.places < LEAST_PLACES || at_s - changed_s < hold_s {
            return None;
        }
        self.places = 0;
        self.is_inside = is_inside;
        Some(if is_inside {
            Change::Entered { at_s: self.since_s }
        } else {
            self.left()
        })
    }

    fn left(&self) -> Change {
        Change::Left {
            at_s: self.inside_s,
            dwell_s: self.inside_s - self.since_s,
        }
    }
}

impl Change {
    fn event(self, zone: usize, track: TrackId) -> ZoneEvent {
        match self {
            Self::Entered { at_s } => ZoneEvent::Entered { zone, track, at_s },
            Self::Left { at_s, dwell_s } => ZoneEvent::Left {
                zone,
                track,
                at_s,
                dwell_s,
            },
        }
    }
}

#[cfg(test)]
mod tests;
