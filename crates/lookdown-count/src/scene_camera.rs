//! A camera of a scene: its lines and zones, and what is known of its last report.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use jiff::{Timestamp, tz::TimeZone};
use lookdown_common::text::one_line;
use lookdown_tracking::{
    Track,
    lines::{Direction, LineCounter, LineState},
    zones::{ZoneCounter, ZoneEvent, ZoneState},
};
use serde::{Deserialize, Serialize};

use crate::{
    definition::{CameraDefinition, DefinitionKey},
    floor::Floor,
    now::{LogPause, Now, milliseconds},
    presence::{Presence, ReportTime},
    report::ReportKey,
    sums::{LineDirection, MINUTE_MS, Sums, TimeSpan, ZoneOf},
};

/// Reports of a camera that are late for this long mean that a clock was set back: tracks begin
/// again at its time.
pub(crate) const LATE_LIMIT: Duration = Duration::from_secs(10);

/// Pause between two log lines about the clock of a camera.
const LOG_PAUSE: Duration = Duration::from_hours(1);

/// A camera of a scene.
pub(crate) struct SceneCamera {
    pub(crate) name: String,
    pub(crate) definition: Arc<CameraDefinition>,
    lines: LineCounter,
    zones: ZoneCounter,
    pub(crate) presence: Presence,
    rate: FrameRate,
    pub(crate) floor: Floor,
    /// Persons in each zone at the last report of this camera.
    zone_persons: Vec<u64>,
    /// The last report of this camera, counted or not.
    pub(crate) last_report: Option<ReportKey>,
    /// Arrival of the last counted report at this process.
    pub(crate) arrived: Option<Instant>,
    /// Arrival of the first of the late reports since the last one in order.
    pub(crate) late_since: Option<Instant>,
    clock_log: LogPause,
}

/// The state of a camera as it is stored.
#[derive(Serialize, Deserialize)]
pub(crate) struct CameraState {
    name: String,
    pub(crate) key: DefinitionKey,
    lines: LineState,
    zones: ZoneState,
    presence: Presence,
    zone_persons: Vec<u64>,
    last_report: Option<ReportKey>,
    floor: Floor,
}

impl CameraState {
    /// Returns the ID of the last report if this is the camera of this name.
    pub(crate) fn last_event_of(&self, camera: &str) -> Option<u64> {
        let report = self.last_report.filter(|_| self.name == camera)?;
        Some(report.event())
    }
}

/// A crossing with its names.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NamedCrossing {
    pub(crate) of: LineDirection,
    pub(crate) at_ms: i64,
}

impl SceneCamera {
    pub(crate) fn new(name: &str, definition: Arc<CameraDefinition>) -> Self {
        Self {
            name: name.to_owned(),
            lines: LineCounter::new(definition.lines.clone(), LineState::default()),
            zones: ZoneCounter::new(definition.zones.clone(), ZoneState::default()),
            presence: Presence::default(),
            rate: FrameRate::default(),
            floor: Floor::default(),
            zone_persons: vec![0; definition.zones.len()],
            last_report: None,
            arrived: None,
            late_since: None,
            clock_log: LogPause::default(),
            definition,
        }
    }

    /// Returns the camera of a stored state.
    pub(crate) fn resumed(state: CameraState, definition: Arc<CameraDefinition>) -> Self {
        let mut zone_persons = state.zone_persons;
        zone_persons.resize(definition.zones.len(), 0);
        Self {
            lines: LineCounter::new(definition.lines.clone(), state.lines),
            zones: ZoneCounter::new(definition.zones.clone(), state.zones),
            presence: state.presence,
            zone_persons,
            last_report: state.last_report,
            floor: state.floor,
            ..Self::new(&state.name, definition)
        }
    }

    /// Returns the state to be stored.
    pub(crate) fn state(&self) -> CameraState {
        CameraState {
            name: self.name.clone(),
            key: self.definition.key.clone(),
            lines: self.lines.state.clone(),
            zones: self.zones.state.clone(),
            presence: self.presence,
            zone_persons: self.zone_persons.clone(),
            last_report: self.last_report,
            floor: self.floor.clone(),
        }
    }

    /// Changes what is counted. Visits and approaches begin again.
    pub(crate) fn redefine(&mut self, definition: Arc<CameraDefinition>) {
        *self = Self {
            presence: self.presence,
            rate: self.rate,
            floor: std::mem::take(&mut self.floor),
            last_report: self.last_report,
            arrived: self.arrived,
            late_since: self.late_since,
            clock_log: self.clock_log,
            ..Self::new(&self.name, definition)
        };
    }

    /// Returns true if a refused report shows that a clock was set back: no report of this camera
    /// was in order for [`LATE_LIMIT`].
    pub(crate) fn is_set_back(&mut self, now: Instant) -> bool {
        let since = *self.late_since.get_or_insert(now);
        now.saturating_duration_since(since) >= LATE_LIMIT
    }

    /// Returns the seconds since the last counted report, 0 for the first one of this process.
    pub(crate) fn elapsed_s(&mut self, now: Instant) -> f64 {
        let last = self.arrived.replace(now).unwrap_or(now);
        now.saturating_duration_since(last).as_secs_f64()
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

    /// Returns the rate of the frames, if the camera has lines, which need a certain one.
    pub(crate) fn rate(&self) -> Option<FrameRate> {
        (!self.definition.lines.is_empty()).then_some(self.rate)
    }

    /// Adds the time since the last report to that with too few frames, if it had too few.
    pub(crate) fn advance_rate(&mut self, time: ReportTime, sums: &mut Sums) {
        let known = self.presence.known(time);
        let slow = known.filter(|known| self.rate.add(*known) && self.rate().is_some());
        for (minute, length_ms) in slow.into_iter().flat_map(TimeSpan::minutes) {
            *sums.slow.entry((self.name.clone(), minute)).or_default() += length_ms;
        }
    }

    /// Returns each zone with its persons now.
    pub(crate) fn occupancy(&self) -> impl Iterator<Item = (&str, usize)> {
        let names = self.zones.zones.iter().map(|zone| zone.name.as_str());
        names.zip(self.zones.occupancy())
    }

    fn zone_of(&self, index: usize) -> ZoneOf {
        let zone = self.zones.zones.get(index);
        ZoneOf {
            camera: self.name.clone(),
            zone: zone.map(|zone| zone.name.clone()).unwrap_or_default(),
        }
    }

    /// Adds the crossings, entries and visits of the tracks to the sums.
    /// Lines have all tracks, zones those that count.
    pub(crate) fn count(
        &mut self,
        [tracks, counted]: [&[&Track]; 2],
        sums: &mut Sums,
    ) -> Vec<NamedCrossing> {
        let mut named = Vec::new();
        for crossing in self.lines.update(tracks.iter().copied()) {
            let line = &self.lines.lines[crossing.line];
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
        for (zone, event) in self.zones.update(counted.iter().copied()) {
            let (ZoneEvent::Entered { at_s } | ZoneEvent::Left { at_s, .. }) = event;
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
    pub(crate) fn advance_zones(&mut self, time: ReportTime, sums: &mut Sums) {
        let known = self.presence.known(time);
        let occupancy = self.zones.occupancy();
        for (index, persons) in occupancy.into_iter().enumerate() {
            let persons = persons as u64;
            let zone = self.zone_of(index);
            let before = std::mem::replace(&mut self.zone_persons[index], persons);
            let parts = known.map(TimeSpan::minutes);
            for (minute, length_ms) in parts.into_iter().flatten().filter(|_| before > 0) {
                let sum = sums.zones.entry((zone.clone(), minute)).or_default();
                sum.person_ms += length_ms * before;
                sum.most = sum.most.max(before);
            }
            if persons > 0 {
                let minute = time.at_ms.div_euclid(MINUTE_MS);
                let sum = sums.zones.entry((zone, minute)).or_default();
                sum.most = sum.most.max(persons);
            }
        }
    }
}

/// Frames per second that lines need: fewer lose crossings and identities
/// (docs/lab/count-accuracy.md, "Rates").
const NEEDED_RATE: f64 = 2.5;
/// The rate is too low from the longer mean interval on, until the shorter one: a camera with just
/// [`NEEDED_RATE`], whose interval is 400 ms, is not marked, milliseconds.
const TOO_LONG_MS: f64 = 450.0;
const ENOUGH_MS: f64 = 420.0;
/// Time over which intervals are averaged: a slow second alone is not marked, milliseconds.
const AVERAGED_MS: f64 = 10_000.0;

/// The mean interval between the frames of a camera, by the times of its reports.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct FrameRate {
    interval_ms: f64,
    /// Time since which the rate is too low, milliseconds since the Unix epoch.
    pub(crate) too_low_since_ms: Option<i64>,
}

impl FrameRate {
    /// Adds the time between two reports. Returns true if it had too few frames.
    pub(crate) fn add(&mut self, time: TimeSpan) -> bool {
        let interval_ms = (time.to_ms - time.from_ms) as f64;
        let weight = 1.0 - (-interval_ms / AVERAGED_MS).exp();
        self.interval_ms += weight * (interval_ms - self.interval_ms);
        let most_ms = match self.too_low_since_ms {
            None => TOO_LONG_MS,
            Some(_) => ENOUGH_MS,
        };
        let since_ms = self.too_low_since_ms.unwrap_or(time.from_ms);
        self.too_low_since_ms = (self.interval_ms > most_ms).then_some(since_ms);
        self.too_low_since_ms.is_some()
    }

    /// Returns the sentence about a rate that is too low, with the remedy.
    pub(crate) fn warning(&self) -> Option<String> {
        let since = Timestamp::from_millisecond(self.too_low_since_ms?).ok()?;
        let since = since
            .to_zoned(TimeZone::system())
            .strftime("%H:%M")
            .to_string();
        let rate = 1000.0 / self.interval_ms;
        Some(format!(
            "counts may be too low since {since}: {rate:.1} frames/s become reports, and lines need \
             {NEEDED_RATE}: choose a higher Rate (`every`) for the camera, or automatic"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lasting_low_rate_is_marked_from_its_beginning() {
        let mut rate = FrameRate::default();
        let mut at_ms = 0;
        let mut send = |seconds: i64, interval_ms: i64| {
            let ends_ms = at_ms + 1000 * seconds;
            let mut marked_ms = 0;
            while at_ms < ends_ms {
                let (from_ms, to_ms) = (at_ms, at_ms + interval_ms);
                let is_slow = rate.add(TimeSpan { from_ms, to_ms });
                marked_ms += if is_slow { interval_ms } else { 0 };
                at_ms = to_ms;
            }
            (marked_ms, rate)
        };
        for (seconds, interval_ms, marked_s) in [
            (60, 200, 0..=0),
            (1, 1000, 0..=0),
            (60, 400, 0..=0),
            (60, 500, 45..=58),
            (60, 400, 10..=20),
            (60, 200, 0..=5),
        ] {
            let (marked_ms, _) = send(seconds, interval_ms);
            let case = format!("{interval_ms}: {marked_ms}");
            assert!(marked_s.contains(&(marked_ms / 1000)), "{case}");
        }
        let (_, rate) = send(30, 1000);
        let warning = rate.warning().unwrap();
        assert!(
            warning.contains("1.0 frames/s") && warning.contains("`every`"),
            "{warning}"
        );
    }
}
