//! A tracker with its cameras, one or all of a site, whose lines and zones count its tracks.

use std::{
    collections::BTreeMap,
    sync::Arc,
    time::{Duration, Instant},
};

use lookdown_common::text::one_line;
use lookdown_tracking::{
    Observation, RefusedReport, SiteError, Track, Tracker, TrackerSettings,
    heat_map::HeatMap,
    lines::{Direction, LineCounter, LineState},
    zones::{DEFAULT_HOLD_S, ZoneCounter, ZoneEvent, ZoneState},
};
use serde::{Deserialize, Serialize};

use crate::{
    definition::CameraDefinition,
    definition_key::DefinitionKey,
    now::{LogPause, Now},
    presence::Presence,
    report::ReportKey,
    sums::{DAY_MS, LineDirection, MINUTE_MS, Owner, Sums, ZoneOf, minutes},
};

/// Reports of a camera that are late for this long mean that a clock was set back: tracks begin again
/// at its time.
pub(crate) const LATE_LIMIT: Duration = Duration::from_secs(10);

/// Pause between two log lines about the clock of a camera.
const LOG_PAUSE: Duration = Duration::from_hours(1);

/// A tracker, the counters of its cameras, and the state of their sums.
pub(crate) struct Scene {
    pub(crate) owner: Owner,
    tracker: Tracker,
    heat_map: HeatMap,
    presence: Presence,
    pub(crate) cameras: Vec<SceneCamera>,
    /// True from a reset of the position until the next report: the server's clock may have been set
    /// back.
    pub(crate) may_begin_again: bool,
}

/// A camera of a scene.
pub(crate) struct SceneCamera {
    pub(crate) name: String,
    pub(crate) definition: Arc<CameraDefinition>,
    lines: LineCounter,
    zones: ZoneCounter,
    presence: Presence,
    /// Persons in each zone at the last report of this camera.
    zone_persons: Vec<u64>,
    /// The last report of this camera, counted or not.
    pub(crate) last_report: Option<ReportKey>,
    /// Arrival of the first of the late reports since the last one in order.
    late_since: Option<Instant>,
    clock_log: LogPause,
}

/// The state of a scene as it is stored.
#[derive(Serialize, Deserialize)]
pub(crate) struct SceneState {
    owner: Owner,
    tracker: Tracker,
    heat_map: HeatMap,
    presence: Presence,
    cameras: Vec<CameraState>,
}

#[derive(Serialize, Deserialize)]
struct CameraState {
    name: String,
    key: DefinitionKey,
    lines: LineState,
    zones: ZoneState,
    presence: Presence,
    zone_persons: Vec<u64>,
    last_report: Option<ReportKey>,
}

/// A crossing with its names.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NamedCrossing {
    pub(crate) of: LineDirection,
    pub(crate) at_ms: i64,
}

impl SceneCamera {
    fn new(name: &str, definition: Arc<CameraDefinition>) -> Self {
        Self {
            name: name.to_owned(),
            lines: line_counter(&definition, LineState::default()),
            zones: zone_counter(&definition, ZoneState::default()),
            presence: Presence::default(),
            zone_persons: vec![0; definition.zones.len()],
            last_report: None,
            late_since: None,
            clock_log: LogPause::default(),
            definition,
        }
    }

    /// Changes what is counted. Visits and approaches begin again.
    fn redefine(&mut self, definition: Arc<CameraDefinition>) {
        *self = Self {
            presence: self.presence,
            last_report: self.last_report,
            late_since: self.late_since,
            clock_log: self.clock_log,
            ..Self::new(&self.name, definition)
        };
    }

    /// Returns true if a refused report shows that a clock was set back: no report of this camera was
    /// in order for [`LATE_LIMIT`].
    pub(crate) fn is_set_back(&mut self, now: Instant) -> bool {
        let since = *self.late_since.get_or_insert(now);
        now.saturating_duration_since(since) >= LATE_LIMIT
    }

    /// Logs that the capture times of the camera are not used.
    pub(crate) fn warn_of_clock(&mut self, ahead_ms: i64, now: Now) {
        if self.clock_log.is_over(LOG_PAUSE, now) {
            let camera = one_line(&self.name);
            let seconds = Duration::from_millis(ahead_ms.unsigned_abs()).as_secs_f64();
            let side = if ahead_ms > 0 { "ahead" } else { "behind" };
            tracing::warn!(
                "captured_at of {camera} is {seconds} s {side}, so the arrival is its time: set the \
                 clock of the camera's client"
            );
        }
    }

    pub(crate) fn presence(&self) -> &Presence {
        &self.presence
    }

    /// Returns each zone with its persons now.
    pub(crate) fn occupancy(&self) -> impl Iterator<Item = (&str, usize)> {
        let names = self.zones.zones().iter().map(|zone| zone.name.as_str());
        names.zip(self.zones.occupancy())
    }

    fn zone_of(&self, index: usize) -> ZoneOf {
        let zone = self.zones.zones().get(index);
        ZoneOf {
            camera: self.name.clone(),
            zone: zone.map(|zone| zone.name.clone()).unwrap_or_default(),
        }
    }

    /// Adds the crossings, entries and visits of the tracks to the sums.
    /// Lines have all tracks, zones those that count.
    fn count(&mut self, [tracks, counted]: [&[&Track]; 2], sums: &mut Sums) -> Vec<NamedCrossing> {
        let mut named = Vec::new();
        for crossing in self.lines.update(tracks.iter().copied()) {
            let line = &self.lines.lines()[crossing.line];
            let direction = match crossing.direction {
                Direction::In => 0,
                Direction::Out => 1,
            };
            let at_ms = milliseconds(crossing.at_s);
            let of = LineDirection {
                camera: self.name.clone(),
                line: line.name.clone(),
                direction: self.definition.directions[crossing.line][direction].clone(),
            };
            let key = (of.clone(), at_ms.div_euclid(MINUTE_MS));
            *sums.crossings.entry(key).or_default() += 1;
            named.push(NamedCrossing { of, at_ms });
        }
        for event in self.zones.update(counted.iter().copied()) {
            let (ZoneEvent::Entered { zone, at_s, .. } | ZoneEvent::Left { zone, at_s, .. }) =
                event;
            let minute = milliseconds(at_s).div_euclid(MINUTE_MS);
            let sum = sums.zones.entry((self.zone_of(zone), minute)).or_default();
            match event {
                ZoneEvent::Entered { .. } => sum.entries += 1,
                ZoneEvent::Left { dwell_s, .. } => {
                    sum.visits += 1;
                    sum.visit_ms += milliseconds(dwell_s).unsigned_abs();
                }
            }
        }
        named
    }

    /// Adds the time since the last report of this camera to its zones.
    fn advance_zones(&mut self, at_ms: i64, longest_gap_ms: i64, sums: &mut Sums) {
        let since = self.presence.known_since(at_ms, longest_gap_ms);
        let occupancy = self.zones.occupancy();
        for (index, persons) in occupancy.into_iter().enumerate() {
            let persons = persons as u64;
            let zone = self.zone_of(index);
            let before = std::mem::replace(&mut self.zone_persons[index], persons);
            let parts = since.map(|since| minutes(since, at_ms));
            for (minute, length_ms) in parts.into_iter().flatten().filter(|_| before > 0) {
                let sum = sums.zones.entry((zone.clone(), minute)).or_default();
                sum.person_ms += length_ms * before;
                sum.most = sum.most.max(before);
            }
            if persons > 0 {
                let minute = at_ms.div_euclid(MINUTE_MS);
                let sum = sums.zones.entry((zone, minute)).or_default();
                sum.most = sum.most.max(persons);
            }
        }
    }
}

impl Scene {
    /// Creates a scene of these cameras without tracks.
    pub(crate) fn new(
        owner: Owner,
        cameras: Vec<(String, Arc<CameraDefinition>)>,
    ) -> Result<Self, SiteError> {
        let poses: Vec<_> = cameras.iter().map(|(_, camera)| camera.pose).collect();
        let mut tracker = Tracker::new(&poses, TrackerSettings::default())?;
        for (index, (_, camera)) in cameras.iter().enumerate() {
            tracker.limit(index, camera.areas.clone());
        }
        let cameras = cameras.into_iter();
        Ok(Self {
            tracker,
            owner,
            heat_map: HeatMap::default(),
            presence: Presence::default(),
            cameras: cameras
                .map(|(name, definition)| SceneCamera::new(&name, definition))
                .collect(),
            may_begin_again: false,
        })
    }

    /// Creates the scene of a stored state. `definition` returns the definition of a key.
    pub(crate) fn resumed(
        state: SceneState,
        mut definition: impl FnMut(DefinitionKey) -> Arc<CameraDefinition>,
    ) -> Self {
        let cameras = state.cameras.into_iter().map(|camera| {
            let definition = definition(camera.key);
            let mut zone_persons = camera.zone_persons;
            zone_persons.resize(definition.zones.len(), 0);
            SceneCamera {
                name: camera.name,
                lines: line_counter(&definition, camera.lines),
                zones: zone_counter(&definition, camera.zones),
                presence: camera.presence,
                zone_persons,
                last_report: camera.last_report,
                late_since: None,
                clock_log: LogPause::default(),
                definition,
            }
        });
        let cameras: Vec<_> = cameras.collect();
        let mut tracker = state.tracker;
        for (index, camera) in cameras.iter().enumerate() {
            tracker.limit(index, camera.definition.areas.clone());
        }
        Self {
            cameras,
            owner: state.owner,
            tracker,
            heat_map: state.heat_map,
            presence: state.presence,
            may_begin_again: false,
        }
    }

    /// Changes what is counted of a camera. Visits and approaches begin again.
    pub(crate) fn redefine(&mut self, camera: usize, definition: Arc<CameraDefinition>) {
        self.tracker.limit(camera, definition.areas.clone());
        self.cameras[camera].redefine(definition);
    }

    /// Returns the state to be stored.
    pub(crate) fn state(&self) -> SceneState {
        let cameras = self.cameras.iter().map(|camera| CameraState {
            name: camera.name.clone(),
            key: camera.definition.key.clone(),
            lines: camera.lines.state().clone(),
            zones: camera.zones.state().clone(),
            presence: camera.presence,
            zone_persons: camera.zone_persons.clone(),
            last_report: camera.last_report,
        });
        SceneState {
            owner: self.owner.clone(),
            tracker: self.tracker.clone(),
            heat_map: self.heat_map.clone(),
            presence: self.presence,
            cameras: cameras.collect(),
        }
    }

    /// Takes the persons of a report, and adds to the sums. Returns the crossings.
    pub(crate) fn accept(
        &mut self,
        camera: usize,
        (at_ms, longest_gap_ms): (i64, i64),
        persons: &[Observation],
        sums: &mut Sums,
    ) -> Result<Vec<NamedCrossing>, RefusedReport> {
        self.tracker.update(camera, seconds(at_ms), persons)?;
        let tracks: Vec<&Track> = self.tracker.tracks().collect();
        let mut crossings = Vec::new();
        // A line at the edge of an area counts those who cross it from the margin.
        let counted = tracks.iter().copied().filter(|track| track.counts());
        let counted: Vec<&Track> = counted.collect();
        for camera in &mut self.cameras {
            crossings.extend(camera.count([&tracks, &counted], sums));
        }
        let tracks = counted;
        self.heat_map.update(tracks.iter().copied());
        let day = at_ms.div_euclid(DAY_MS);
        for (cell, milliseconds) in self.heat_map.take() {
            let key = (self.owner.clone(), day, cell);
            *sums.cells.entry(key).or_default() += milliseconds;
        }
        let tracked = tracks.len() as u64;
        let time = (at_ms, longest_gap_ms);
        let is_site = matches!(self.owner, Owner::Site(_));
        let reporting = &mut self.cameras[camera];
        reporting.late_since = None;
        reporting.advance_zones(at_ms, longest_gap_ms, sums);
        let own = if is_site {
            let own = tracks
                .iter()
                .filter(|track| track.last_person().camera == camera);
            own.count() as u64
        } else {
            tracked
        };
        let owner = Owner::Camera(reporting.name.clone());
        reporting.presence.advance(&owner, time, own, sums);
        if is_site {
            self.presence.advance(&self.owner, time, tracked, sums);
        }
        Ok(crossings)
    }

    /// Returns the tracks that count.
    pub(crate) fn tracks(&self) -> impl Iterator<Item = &Track> {
        self.tracker.tracks().filter(|track| track.counts())
    }

    /// Returns the persons of the site at its last report.
    pub(crate) fn presence(&self) -> &Presence {
        match self.owner {
            Owner::Site(_) => &self.presence,
            Owner::Camera(_) => &self.cameras[0].presence,
        }
    }

    /// Returns a camera and its index.
    pub(crate) fn camera(&self, name: &str) -> Option<(usize, &SceneCamera)> {
        let mut cameras = self.cameras.iter().enumerate();
        cameras.find(|(_, camera)| camera.name == name)
    }

    pub(crate) fn definitions(&self) -> BTreeMap<String, Arc<CameraDefinition>> {
        let cameras = self.cameras.iter();
        cameras
            .map(|camera| (camera.name.clone(), Arc::clone(&camera.definition)))
            .collect()
    }
}

// The definition was checked: counters accept it. Without it, nothing is counted.
fn line_counter(definition: &CameraDefinition, state: LineState) -> LineCounter {
    LineCounter::resumed(definition.lines.clone(), state).unwrap_or_else(|error| {
        tracing::warn!("the lines of {:?} are not counted: {error}", definition.key);
        LineCounter::default()
    })
}

fn zone_counter(definition: &CameraDefinition, state: ZoneState) -> ZoneCounter {
    ZoneCounter::resumed(definition.zones.clone(), DEFAULT_HOLD_S, state).unwrap_or_else(|error| {
        tracing::warn!("the zones of {:?} are not counted: {error}", definition.key);
        ZoneCounter::default()
    })
}

fn seconds(milliseconds: i64) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "exact for 285,000 years")]
    let milliseconds = milliseconds as f64;
    milliseconds / 1000.0
}

fn milliseconds(seconds: f64) -> i64 {
    #[expect(clippy::cast_possible_truncation, reason = "times of reports")]
    let milliseconds = (seconds * 1000.0).round() as i64;
    milliseconds
}

#[cfg(test)]
mod tests;
