//! People on the floor: who has been lying for a while, outside of zones where that is
//! expected. Someone who is no longer detected there still lies there. What was there from the
//! start, and neither moved nor stood nor sat, may be a table or a plant, and begins no alert.

use std::collections::HashMap;

use lookdown_lens::geometry::{
    Pixel, Posture, ZoneArea,
    floor::floor_position,
    posture::{MOSTLY_DOWN, SAME_LENGTH, SETTLED_MS, UP_MS},
};
use lookdown_tracking::{Track, TrackId};
use nalgebra::Point2;
use serde::{Deserialize, Serialize};

use crate::{definition::CameraDefinition, now::milliseconds};

/// Most people of a camera.
const MAX_PERSONS: usize = 64;
/// Limit of the same box: the way of its middle as a share of its longer side.
const SAME_PLACE: f64 = 0.25;
/// Someone without an alert is forgotten after this time without a detection, milliseconds: boxes
/// of people who lie come and go, and who gets up is seen.
const UNSEEN_MS: i64 = 30_000;
/// The same with an alert that was acknowledged, and with one that was not.
const UNSEEN_ACKNOWLEDGED_MS: i64 = 10 * 60_000;
const UNSEEN_ALERT_MS: i64 = 24 * 3_600_000;
/// A zone is near a person within this distance: in widths of the frame, and in meters.
const NEAR_FRAME: f64 = 0.1;
const NEAR_M: f64 = 1.5;

/// A person who is down.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct PersonDown {
    pub(crate) id: u64,
    track: TrackId,
    pub(crate) posture: Posture,
    /// Time since which the person is down, milliseconds since the Unix epoch.
    pub(crate) since_ms: i64,
    pub(crate) seen_ms: i64,
    /// Center and longer side of the last box that showed the person down, frame pixels.
    pub(crate) center_px: [f64; 2],
    length_px: f64,
    /// The zone that holds the person, or one nearby.
    pub(crate) zone: Option<String>,
    up_since_ms: Option<i64>,
    /// The sum of the times between two detections, each with the probability that the person was
    /// down, milliseconds.
    #[serde(default)]
    down_ms: f64,
    /// True once the person has been down for the time of an alert.
    pub(crate) is_alert: bool,
    pub(crate) is_acknowledged: bool,
}

/// The people on the floor of a camera.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Floor {
    /// Everyone who is down, longest first.
    pub(crate) persons: Vec<PersonDown>,
    last_id: u64,
    /// The last boxes of those who are or were tracked. A restart forgets them.
    #[serde(skip)]
    boxes: HashMap<TrackId, LastBox>,
}

/// The box of a track.
#[derive(Debug, Clone, Copy, PartialEq)]
struct LastBox {
    center_px: [f64; 2],
    length_px: f64,
    /// The time for which the person sat in it, and the last time, milliseconds.
    seated_ms: i64,
    seen_ms: i64,
    /// True once the track has moved, stood or sat, as things do not.
    is_person: bool,
}

impl Floor {
    /// Returns the people with an alert, longest first.
    pub(crate) fn alerts(&self) -> impl Iterator<Item = &PersonDown> {
        self.persons.iter().filter(|person| person.is_alert)
    }

    /// Acknowledges an alert. Returns false for an unknown one.
    pub(crate) fn acknowledge(&mut self, id: u64) -> bool {
        let mut persons = self.persons.iter_mut();
        let person = persons.find(|person| person.id == id && person.is_alert);
        person.map(|person| person.is_acknowledged = true).is_some()
    }

    /// Takes the tracks that a report of the camera shows. An alert begins after `after_ms`.
    pub(crate) fn update(
        &mut self,
        tracks: &[&Track],
        at_ms: i64,
        after_ms: i64,
        definition: &CameraDefinition,
    ) {
        self.boxes
            .retain(|_, last| at_ms - last.seen_ms <= UNSEEN_MS);
        for track in tracks {
            let is_expected = zone_of(track, definition, true).is_some();
            let belief = track.posture_belief();
            let last = self.last_box(track, belief.sits(), at_ms);
            last.is_person |= track.has_moved() || belief.is_up();
            let can_be_down = last.is_person && last.seated_ms < SETTLED_MS;
            let is_down = belief.is_down() && !is_expected && can_be_down;
            if let Some(index) = self.index_of(track, tracks) {
                let is_up = belief.is_up() || is_expected;
                self.persons[index].see(track, at_ms, is_down, is_up, definition);
            } else if is_down && self.persons.len() < MAX_PERSONS {
                self.last_id += 1;
                let mut person = PersonDown {
                    id: self.last_id,
                    track: track.id,
                    posture: Posture::Unknown,
                    since_ms: at_ms,
                    seen_ms: at_ms,
                    center_px: track.center_px,
                    length_px: 0.0,
                    zone: None,
                    up_since_ms: None,
                    down_ms: 0.0,
                    is_alert: false,
                    is_acknowledged: false,
                };
                person.see(track, at_ms, true, false, definition);
                self.persons.push(person);
            }
        }
        for person in &mut self.persons {
            let is_down = person.up_since_ms.is_none() && person.seen_ms == at_ms;
            let lasts_ms = at_ms - person.since_ms;
            let is_mostly_down = person.down_ms >= MOSTLY_DOWN * lasts_ms as f64;
            person.is_alert |= is_down && is_mostly_down && lasts_ms >= after_ms;
        }
        self.persons.retain(|person| !person.is_over(at_ms));
    }

    /// Returns the box of a track, with the time for which the person sat in the same one.
    fn last_box(&mut self, track: &Track, sits: bool, at_ms: i64) -> &mut LastBox {
        let now = LastBox {
            center_px: track.center_px,
            length_px: track.length_px,
            seated_ms: 0,
            seen_ms: at_ms,
            is_person: false,
        };
        let last = self.boxes.entry(track.id).or_insert(now);
        if !last.is_same(&now) {
            let is_person = last.is_person;
            *last = LastBox { is_person, ..now };
        }
        if sits {
            last.seated_ms += at_ms - last.seen_ms;
        }
        last.seen_ms = at_ms;
        last
    }

    /// Returns the known person of a track: the same track, or one that began where someone was
    /// lost.
    fn index_of(&self, track: &Track, tracks: &[&Track]) -> Option<usize> {
        let same = |person: &PersonDown| person.track == track.id;
        let is_lost = |person: &PersonDown| {
            let is_seen = tracks.iter().any(|track| track.id == person.track);
            let [x, y] = track.center_px;
            let [own_x, own_y] = person.center_px;
            let is_near = (x - own_x).hypot(y - own_y) <= person.length_px / 2.0;
            let began_ms = milliseconds(track.first_seen_s);
            !is_seen && is_near && began_ms > person.since_ms
        };
        let mut persons = self.persons.iter();
        let own = persons.position(same);
        own.or_else(|| self.persons.iter().position(is_lost))
    }
}

impl LastBox {
    fn is_same(&self, now: &Self) -> bool {
        let [x, y] = self.center_px;
        let moved = (x - now.center_px[0]).hypot(y - now.center_px[1]);
        let ratio = self.length_px / now.length_px;
        moved <= SAME_PLACE * self.length_px && (1.0 / SAME_LENGTH..=SAME_LENGTH).contains(&ratio)
    }
}

impl PersonDown {
    fn see(
        &mut self,
        track: &Track,
        at_ms: i64,
        is_down: bool,
        is_up: bool,
        definition: &CameraDefinition,
    ) {
        let elapsed_ms = at_ms - self.seen_ms;
        self.down_ms += track.posture_belief().down_probability() * elapsed_ms as f64;
        self.track = track.id;
        self.seen_ms = at_ms;
        if is_up {
            self.up_since_ms.get_or_insert(at_ms);
            return;
        }
        if is_down {
            self.up_since_ms = None;
            self.posture = track.posture().0;
            self.center_px = track.center_px;
            self.length_px = track.length_px;
            self.zone = zone_of(track, definition, false);
        }
    }

    fn is_over(&self, at_ms: i64) -> bool {
        let unseen_ms = match (self.is_alert, self.is_acknowledged) {
            (false, _) => UNSEEN_MS,
            (true, true) => UNSEEN_ACKNOWLEDGED_MS,
            (true, false) => UNSEEN_ALERT_MS,
        };
        let is_up = self
            .up_since_ms
            .is_some_and(|since_ms| self.seen_ms - since_ms >= UP_MS);
        is_up || at_ms - self.seen_ms > unseen_ms
    }
}

/// Returns the name of the zone that holds a person's center: one where lying is expected, or any,
/// then also one nearby.
fn zone_of(track: &Track, definition: &CameraDefinition, is_expected: bool) -> Option<String> {
    let camera = definition.geometry.as_ref()?;
    let [x, y] = track.center_px;
    let center = Pixel::new(x, y);
    let floor = floor_position(center, &camera.lens, &camera.mount);
    let near_px = NEAR_FRAME * f64::from(definition.key.width);
    let zones = || {
        camera
            .areas
            .zones
            .iter()
            .filter(|zone| zone.is_lying_expected || !is_expected)
    };
    let is_near = |area: &ZoneArea| match area {
        ZoneArea::Frame(area) => area.holds_within(center, near_px),
        ZoneArea::Floor(area) => {
            floor.is_some_and(|floor| area.holds_within(Point2::new(floor.x_m, floor.y_m), NEAR_M))
        }
    };
    let inside = zones().find(|zone| zone.area.holds(center, floor));
    let near = || zones().find(|zone| !is_expected && is_near(&zone.area));
    Some(inside.or_else(near)?.name.clone())
}

#[cfg(test)]
mod tests;
