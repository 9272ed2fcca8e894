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

/// Time after which a person's new side of the outline counts, seconds.
const HOLD_S: f64 = 1.0;
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
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ZoneEvent {
    /// A person entered, or appeared inside.
    Entered {
        /// Time of the first place inside, seconds since the Unix epoch.
        at_s: f64,
    },
    /// A person left, or its track ended inside.
    Left {
        /// Time of the last place inside, seconds since the Unix epoch.
        at_s: f64,
        /// Time between the first and the last place inside, seconds.
        dwell_s: f64,
    },
}

/// The zones over the tracks of one tracker.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ZoneCounter {
    /// The zones.
    pub zones: Vec<Zone>,
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
    /// Returns a counter of the zones that `state` was kept for; with an empty one, a new counter.
    pub fn new(zones: Vec<Zone>, mut state: ZoneState) -> Self {
        state.tracks.retain(|_, visits| visits.len() == zones.len());
        Self { zones, state }
    }

    /// Returns entries and exits since the last call, each with the index of its zone. `tracks` are
    /// all confirmed tracks of the tracker, after each of its updates: a track that is gone leaves
    /// its zones.
    pub fn update<'a>(
        &mut self,
        tracks: impl IntoIterator<Item = &'a Track>,
    ) -> Vec<(usize, ZoneEvent)> {
        let mut events = Vec::new();
        let mut states = BTreeMap::new();
        let mut before = std::mem::take(&mut self.state.tracks);
        for track in tracks {
            let known = before.remove(&track.id);
            let mut visits = known.unwrap_or_else(|| vec![Visit::default(); self.zones.len()]);
            for (zone, visit) in visits.iter_mut().enumerate() {
                let changes = visit.advance(&self.zones[zone], track.tail());
                events.extend(changes.into_iter().map(|event| (zone, event)));
            }
            states.insert(track.id, visits);
        }
        for visits in before.values() {
            let visits = visits.iter().enumerate();
            let inside = visits.filter(|(_, visit)| visit.is_inside);
            events.extend(inside.map(|(zone, visit)| (zone, visit.left())));
        }
        self.state.tracks = states;
        events
    }

    /// Returns the number of persons in each zone.
    pub fn occupancy(&self) -> Vec<usize> {
        let mut persons = vec![0; self.zones.len()];
        for visits in self.state.tracks.values() {
            for (persons, visit) in persons.iter_mut().zip(visits) {
                *persons += usize::from(visit.is_inside);
            }
        }
        persons
    }
}

impl Visit {
    /// Follows the new points of a track and returns the entries and exits that now hold.
    fn advance<'a>(
        &mut self,
        zone: &Zone,
        tail: impl Iterator<Item = &'a TailPoint>,
    ) -> Vec<ZoneEvent> {
        let mut changes = Vec::new();
        for point in tail {
            let is_known = self.seen_s.is_some_and(|seen_s| point.at_s <= seen_s);
            let Some(place) = point.place(zone.plane).filter(|_| !is_known) else {
                continue;
            };
            self.seen_s = Some(point.at_s);
            let is_inside = zone.area.holds(Point2::from(place));
            changes.extend(self.see(is_inside, point.at_s));
        }
        changes
    }

    /// Takes one place into account.
    fn see(&mut self, is_inside: bool, at_s: f64) -> Option<ZoneEvent> {
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
        if self.places < LEAST_PLACES || at_s - changed_s < HOLD_S {
            return None;
        }
        self.places = 0;
        self.is_inside = is_inside;
        Some(if is_inside {
            ZoneEvent::Entered { at_s: self.since_s }
        } else {
            self.left()
        })
    }

    fn left(&self) -> ZoneEvent {
        ZoneEvent::Left {
            at_s: self.inside_s,
            dwell_s: self.inside_s - self.since_s,
        }
    }
}

#[cfg(test)]
mod tests;
