//! The current counts of all cameras and sites, for metrics and MQTT.

use crate::{
    counter::{Counter, MAX_AHEAD_MS},
    floor::PersonDown,
    sums::{LineDirection, Owner, ZoneOf},
};

/// The current counts.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Snapshot {
    /// The cameras, by name.
    pub cameras: Vec<CameraSnapshot>,
    /// The sites, by name.
    pub sites: Vec<SiteSnapshot>,
}

/// The current counts of a camera.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CameraSnapshot {
    /// The name.
    pub name: String,
    /// Time of the last frame, milliseconds since the Unix epoch.
    pub last_report_ms: i64,
    /// True for a camera of this process that is paused.
    pub is_paused: bool,
    /// Persons now; `None` while unknown.
    pub persons: Option<u64>,
    /// In 90 % of frames, the true number is from the first of these to the second.
    pub bar: Option<[u64; 2]>,
    /// Time since which its lines have too few frames, milliseconds since the Unix epoch.
    pub too_low_since_ms: Option<i64>,
    /// The floor alerts, longest first; `None` without the setting.
    pub floor_alerts: Option<Vec<FloorAlert>>,
    /// The directions of its lines.
    pub lines: Vec<LineSnapshot>,
    /// Its zones.
    pub zones: Vec<ZoneSnapshot>,
}

/// A person who has been on the floor for a while.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FloorAlert {
    /// The identifier, unique per camera.
    pub id: u64,
    /// `lying`, `low` or `unknown`.
    pub posture: &'static str,
    /// Time since which the person is down, milliseconds since the Unix epoch.
    pub since_ms: i64,
    /// The zone that holds the person, or one nearby.
    pub zone: Option<String>,
    /// True once a user has acknowledged the alert.
    pub is_acknowledged: bool,
}

impl From<&PersonDown> for FloorAlert {
    fn from(person: &PersonDown) -> Self {
        Self {
            id: person.id,
            posture: person.posture.name(),
            since_ms: person.since_ms,
            zone: person.zone.clone(),
            is_acknowledged: person.is_acknowledged,
        }
    }
}

/// The crossings of a line in a direction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LineSnapshot {
    /// The name of the line.
    pub line: String,
    /// The name of the direction.
    pub direction: String,
    /// Crossings since the store was created.
    pub crossings: u64,
}

/// The current counts of a zone.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ZoneSnapshot {
    /// The name.
    pub zone: String,
    /// Persons now; `None` while unknown.
    pub persons: Option<u64>,
    /// Entries since the store was created.
    pub entries: u64,
    /// Time that persons spent in the zone since the store was created, milliseconds.
    pub person_ms: u64,
}

/// The current counts of a site.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SiteSnapshot {
    /// The name.
    pub name: String,
    /// Persons now; `None` while unknown.
    pub persons: Option<u64>,
}

impl Snapshot {
    /// Returns the number of persons at a camera; `None` while it is unknown.
    pub(crate) fn persons(&self, camera: &str) -> Option<u64> {
        let known = self.cameras.iter().find(|known| known.name == camera);
        known?.persons
    }
}

impl Counter {
    /// Returns the reason why a camera is not counted now, or why its counts may be too low.
    pub(crate) fn warning(&self, camera: &str) -> Option<String> {
        let rate = || self.scene_of(camera)?.camera(camera)?.1.rate()?.warning();
        self.drops.reason(camera).or_else(rate)
    }

    /// Returns the current counts.
    pub(crate) fn snapshot(&self, now_ms: i64) -> Snapshot {
        let is_known = |last_ms: Option<i64>| {
            // A report of the future says nothing about the present.
            let ages = -MAX_AHEAD_MS..=self.longest_gap_ms();
            last_ms.is_some_and(|last_ms| ages.contains(&(now_ms - last_ms)))
        };
        let mut snapshot = Snapshot::default();
        for scene in self.scenes() {
            if let Owner::Site(name) = &scene.owner {
                let presence = scene.presence();
                snapshot.sites.push(SiteSnapshot {
                    name: name.clone(),
                    persons: is_known(presence.last_ms).then_some(presence.persons),
                });
            }
            for camera in &scene.cameras {
                let presence = camera.presence;
                let Some(last_report_ms) = presence.last_ms else {
                    continue;
                };
                let is_paused = self.is_paused(&camera.name);
                let is_known = is_known(Some(last_report_ms)) && !is_paused;
                let directions = camera
                    .definition
                    .lines
                    .iter()
                    .zip(&camera.definition.directions);
                let lines = directions.flat_map(|(line, directions)| {
                    directions.iter().map(|direction| {
                        let of = LineDirection {
                            camera: camera.name.clone(),
                            line: line.name.clone(),
                            direction: direction.clone(),
                        };
                        let crossings = self.stored_totals.crossings.get(&of);
                        LineSnapshot {
                            crossings: crossings.copied().unwrap_or_default(),
                            line: of.line,
                            direction: of.direction,
                        }
                    })
                });
                let zones = camera.occupancy().map(|(zone, persons)| {
                    let of = ZoneOf {
                        camera: camera.name.clone(),
                        zone: zone.to_owned(),
                    };
                    let total = self
                        .stored_totals
                        .zones
                        .get(&of)
                        .copied()
                        .unwrap_or_default();
                    ZoneSnapshot {
                        zone: of.zone,
                        persons: is_known.then_some(persons as u64),
                        entries: total.entries,
                        person_ms: total.person_ms,
                    }
                });
                snapshot.cameras.push(CameraSnapshot {
                    name: camera.name.clone(),
                    last_report_ms,
                    is_paused,
                    persons: is_known.then_some(presence.persons),
                    bar: is_known.then(|| self.bar(&camera.name, presence.persons)),
                    too_low_since_ms: camera
                        .rate()
                        .filter(|_| is_known)
                        .and_then(|rate| rate.too_low_since_ms),
                    floor_alerts: (self.floor_alert_after_ms())
                        .map(|_| camera.floor.alerts().map(FloorAlert::from).collect()),
                    lines: lines.collect(),
                    zones: zones.collect(),
                });
            }
        }
        snapshot
            .cameras
            .sort_by(|one, other| one.name.cmp(&other.name));
        snapshot
    }
}
