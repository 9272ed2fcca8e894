//! Sums per minute that are added to the store.

use std::{collections::BTreeMap, fmt};

use lookdown_common::text::one_line;
use lookdown_tracking::heat_map::Cell;
use serde::{Deserialize, Serialize};

/// Milliseconds of a minute and of a day.
pub(crate) const MINUTE_MS: i64 = 60_000;
pub(crate) const DAY_MS: i64 = 86_400_000;

/// A camera, or a site of several cameras.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Owner {
    /// A camera.
    Camera(String),
    /// A site.
    Site(String),
}

/// `camera hall`
impl fmt::Display for Owner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (kind, name) = match self {
            Self::Camera(name) => ("camera", name),
            Self::Site(name) => ("site", name),
        };
        write!(f, "{kind} {}", one_line(name))
    }
}

/// The minute or the day of a sum: its number since the Unix epoch.
pub(crate) type Period = i64;

/// Sums that are not stored yet.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Sums {
    /// Known time and persons per minute.
    pub(crate) presence: BTreeMap<(Owner, Period), PresenceSum>,
    /// Milliseconds with fewer frames than lines need, per camera and minute.
    pub(crate) slow: BTreeMap<(String, Period), u64>,
    /// Crossings per camera, line, direction and minute.
    pub(crate) crossings: BTreeMap<(LineDirection, Period), u64>,
    /// Sums per camera, zone and minute.
    pub(crate) zones: BTreeMap<(ZoneOf, Period), ZoneSum>,
    /// Milliseconds of presence per cell and day.
    pub(crate) cells: BTreeMap<(Owner, Period, Cell), u64>,
}

/// A direction of a line.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct LineDirection {
    pub(crate) camera: String,
    pub(crate) line: String,
    pub(crate) direction: String,
}

/// A zone of a camera.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct ZoneOf {
    pub(crate) camera: String,
    pub(crate) zone: String,
}

/// The persons of a time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct PresenceSum {
    /// Milliseconds for which the number of persons is known.
    pub(crate) known_ms: u64,
    /// Persons times milliseconds.
    pub(crate) person_ms: u64,
    /// Most persons at once.
    pub(crate) most: u64,
    /// The ends of the bar times milliseconds; `None` where it is unknown for a part.
    pub(crate) bar_ms: Option<[u64; 2]>,
}

impl PresenceSum {
    /// Adds a time with this number of persons.
    pub(crate) fn add_time(&mut self, length_ms: u64, persons: u64, bar: Option<[u64; 2]>) {
        let of_time = bar.map(|[low, high]| [low.min(persons), high.max(persons)]);
        self.add(&Self {
            known_ms: length_ms,
            person_ms: length_ms * persons,
            most: persons,
            bar_ms: of_time.map(|ends| ends.map(|end| end * length_ms)),
        });
    }

    /// Adds another sum.
    pub(crate) fn add(&mut self, other: &Self) {
        let is_new = self.known_ms == 0;
        self.bar_ms = match (self.bar_ms, other.bar_ms) {
            (bar, _) if other.known_ms == 0 => bar,
            (_, bar) if is_new => bar,
            (Some([low, high]), Some(more)) => Some([low + more[0], high + more[1]]),
            _ => None,
        };
        self.known_ms += other.known_ms;
        self.person_ms += other.person_ms;
        self.most = self.most.max(other.most);
    }
}

/// The persons in a zone in a time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct ZoneSum {
    /// Persons who entered.
    pub(crate) entries: u64,
    /// Visits that ended.
    pub(crate) visits: u64,
    /// Their durations, milliseconds.
    pub(crate) visit_ms: u64,
    /// Persons times milliseconds.
    pub(crate) person_ms: u64,
    /// Most persons at once.
    pub(crate) most: u64,
}

/// Counts since the store was created.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Totals {
    pub(crate) crossings: BTreeMap<LineDirection, u64>,
    pub(crate) zones: BTreeMap<ZoneOf, ZoneTotal>,
}

/// The counts of a zone since the store was created.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct ZoneTotal {
    pub(crate) entries: u64,
    /// Time that persons spent in the zone, milliseconds.
    pub(crate) person_ms: u64,
}

impl Totals {
    /// Removes those of a camera.
    pub(crate) fn remove(&mut self, camera: &str) {
        self.crossings.retain(|of, _| of.camera != camera);
        self.zones.retain(|of, _| of.camera != camera);
    }

    /// Adds sums.
    pub(crate) fn add(&mut self, sums: &Sums) {
        for ((of, _), crossings) in &sums.crossings {
            *self.crossings.entry(of.clone()).or_default() += crossings;
        }
        for ((of, _), sum) in &sums.zones {
            let total = self.zones.entry(of.clone()).or_default();
            total.entries += sum.entries;
            total.person_ms += sum.person_ms;
        }
    }
}

impl Sums {
    /// Removes those of a camera.
    pub(crate) fn remove(&mut self, camera: &str) {
        let owner = Owner::Camera(camera.to_owned());
        self.presence.retain(|(of, _), _| *of != owner);
        self.slow.retain(|(of, _), _| of != camera);
        self.crossings.retain(|(of, _), _| of.camera != camera);
        self.zones.retain(|(of, _), _| of.camera != camera);
        self.cells.retain(|(of, ..), _| *of != owner);
    }

    /// Adds other sums.
    pub(crate) fn add(&mut self, other: Self) {
        for (key, sum) in other.presence {
            self.presence.entry(key).or_default().add(&sum);
        }
        for (key, milliseconds) in other.slow {
            *self.slow.entry(key).or_default() += milliseconds;
        }
        for (key, crossings) in other.crossings {
            *self.crossings.entry(key).or_default() += crossings;
        }
        for (key, sum) in other.zones {
            let own = self.zones.entry(key).or_default();
            own.entries += sum.entries;
            own.visits += sum.visits;
            own.visit_ms += sum.visit_ms;
            own.person_ms += sum.person_ms;
            own.most = own.most.max(sum.most);
        }
        for (key, milliseconds) in other.cells {
            *self.cells.entry(key).or_default() += milliseconds;
        }
    }
}

/// A time in milliseconds since the Unix epoch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct TimeSpan {
    pub(crate) from_ms: i64,
    /// The end, which is not part of it.
    pub(crate) to_ms: i64,
}

impl TimeSpan {
    /// Splits the time into its parts per minute: the minute and the milliseconds in it.
    pub(crate) fn minutes(self) -> impl Iterator<Item = (Period, u64)> {
        let first = self.from_ms.div_euclid(MINUTE_MS);
        let last = self.to_ms.div_euclid(MINUTE_MS);
        (first..=last).filter_map(move |minute| {
            let start = self.from_ms.max(minute * MINUTE_MS);
            let end = self.to_ms.min((minute + 1) * MINUTE_MS);
            let length = u64::try_from(end - start).ok()?;
            (length > 0).then_some((minute, length))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_is_split_at_the_minutes() {
        let minutes = |from_ms, to_ms| {
            let parts = TimeSpan { from_ms, to_ms }.minutes();
            parts.collect::<Vec<_>>()
        };
        let parts = minutes(59_000, 181_000);
        assert_eq!(parts, [(0, 1_000), (1, 60_000), (2, 60_000), (3, 1_000)]);
        assert_eq!(minutes(60_000, 120_000), [(1, 60_000)]);
        assert!(minutes(5, 5).is_empty());
    }
}
