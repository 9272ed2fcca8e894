//! The profile and the rate of a camera, chosen by the time that searches of the whole frame take.
//!
//! A camera whose profile or rate is not named has several operating points, best first. Searches
//! that take too long choose a cheaper one at once; a better one is tried again after a while.
//! Where even the cheapest is too slow, fewer frames are sent: the sender waits for each answer.

use std::{
    fmt,
    time::{Duration, Instant},
};

use jiff::Timestamp;

/// The profile for machines that are too slow for that of the server.
const FAST: &str = "fast";
/// The interval for counts: fewer frames lose crossings (docs/lab/count-accuracy.md).
const COUNTING_EVERY: Duration = Duration::from_millis(200);
/// The interval of sources that send single images, and of slow machines.
pub(crate) const DEFAULT_EVERY: Duration = Duration::from_secs(1);
/// Longest search at an operating point, in its intervals. With one frame left out, people are
/// still in reach of the crops of the next one.
const MAX_INTERVALS: f64 = 1.2;
/// The cost of a search with `balanced` as a multiple of one with `fast`, measured on two cores
/// without VNNI (7.6 and 2.9 runs of the network).
const COST_OF_DEFAULT: f64 = 2.6;
/// Number of searches whose median is compared.
const SEARCHES: usize = 3;
/// A better point is tried if its searches would take at most this share of the limit.
const MARGIN: f64 = 0.7;
/// Time before a better point is tried. Doubled each time when the better one lasts no longer.
const HOLD: Duration = Duration::from_secs(30);
/// Longest such time.
const MAX_HOLD: Duration = Duration::from_mins(10);

/// A profile and an interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct OperatingPoint {
    /// True for [`FAST`], false for the profile of the camera or the server.
    is_fast: bool,
    every: Duration,
}

/// The operating points that a camera may have, best first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OperatingPoints(Vec<OperatingPoint>);

impl OperatingPoints {
    /// Returns the points of a camera. A named profile or interval is kept. Only a stream has
    /// frames at more than one rate.
    pub(crate) fn new(has_profile: bool, every: Option<Duration>, is_stream: bool) -> Self {
        let intervals = match every {
            Some(every) => vec![every],
            None if is_stream => vec![COUNTING_EVERY, DEFAULT_EVERY],
            None => vec![DEFAULT_EVERY],
        };
        let profiles: &[bool] = if has_profile {
            &[false]
        } else {
            &[false, true]
        };
        let of_interval = |every| {
            profiles
                .iter()
                .map(move |&is_fast| OperatingPoint { is_fast, every })
        };
        Self(intervals.into_iter().flat_map(of_interval).collect())
    }

    /// Returns the shortest interval, at which the source is read.
    pub(crate) fn shortest_interval(&self) -> Duration {
        self.0[0].every
    }
}

/// A finished search of a whole frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct FinishedSearch {
    /// The profile that was used.
    pub(crate) profile: String,
    /// True if the profile is a setting of the server or of the calibration.
    pub(crate) is_profile_named: bool,
    /// Time from the request to the answer.
    pub(crate) took: Duration,
}

/// The profile and the rate of a camera, with the reason.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// The profile.
    pub profile: String,
    /// Most frames per second.
    pub rate: f64,
    /// The time of a search of the whole frame, when the choice was made.
    pub search: Duration,
    /// The time since which the rate is too low for counts, because searches take too long.
    pub slow_since: Option<Timestamp>,
}

impl Choice {
    /// Returns true for the same profile and rate.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        (&self.profile, self.rate) == (&other.profile, other.rate)
    }

    /// Returns the sentence for people, if the rate is too low for counts.
    pub(crate) fn warning(&self) -> Option<String> {
        let since = self.slow_since?.to_zoned(jiff::tz::TimeZone::system());
        let wanted = COUNTING_EVERY.as_secs_f64().recip();
        let since = since.strftime("%H:%M");
        Some(format!(
            "counts may be too low since {since}: the machine is too slow for {wanted} frames/s; now {self}: send fewer cameras to it, or give it more cores"
        ))
    }
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (profile, rate) = (&self.profile, self.rate);
        let seconds = self.search.as_secs_f64();
        let unit = if rate == 1.0 { "frame/s" } else { "frames/s" };
        write!(
            f,
            "{profile} at {rate} {unit}: a search takes {seconds:.1} s"
        )
    }
}

/// The current operating point of a camera, with what is needed to choose the next one.
#[derive(Debug)]
pub(crate) struct Governor {
    points: Vec<OperatingPoint>,
    current: usize,
    /// The name of the profile in use.
    profile: String,
    /// The last searches at this point. The first one, which builds tables, is left out.
    searches: Vec<Duration>,
    is_warm: bool,
    since: Instant,
    /// The time since which the rate is lower than counts need.
    slow_since: Option<Timestamp>,
    hold: Duration,
}

impl Governor {
    /// Starts at the cheapest point, whose searches tell soonest what the machine can do.
    pub(crate) fn new(points: &OperatingPoints, now: Instant) -> Self {
        Self {
            current: points.0.len() - 1,
            points: points.0.clone(),
            profile: String::new(),
            searches: Vec::new(),
            is_warm: false,
            since: now,
            slow_since: None,
            hold: Duration::ZERO,
        }
    }

    /// Returns the interval between two frames.
    pub(crate) fn every(&self) -> Duration {
        self.points[self.current].every
    }

    /// Returns the profile to request, if it is not that of the camera or the server. The first
    /// search requests none: only its report tells whether that of the server is a setting.
    pub(crate) fn profile(&self) -> Option<&'static str> {
        let has_searched = !self.profile.is_empty();
        (has_searched && self.points[self.current].is_fast).then_some(FAST)
    }

    /// Returns the point, once it was chosen by a measurement.
    pub(crate) fn choice(&self) -> Option<Choice> {
        let last = *self.searches.get(SEARCHES - 1)?;
        Some(Choice {
            profile: self.profile.clone(),
            rate: self.every().as_secs_f64().recip(),
            search: last,
            slow_since: self.slow_since,
        })
    }

    /// Records a search. Returns true if another point is used from now on.
    pub(crate) fn record(&mut self, search: FinishedSearch, now: Instant) -> bool {
        if search.is_profile_named && self.points.iter().any(|point| point.is_fast) {
            self.keep_profile();
        }
        self.profile = search.profile;
        if !std::mem::replace(&mut self.is_warm, true) {
            return false;
        }
        self.searches.push(search.took);
        let Some(oldest) = self.searches.len().checked_sub(SEARCHES) else {
            return false;
        };
        self.searches.drain(..oldest);
        let mut sorted = self.searches.clone();
        sorted.sort_unstable();
        let next = self.choose(sorted[SEARCHES / 2], now);
        let is_slow = self.points[next].every > self.points[0].every;
        let since = self.slow_since.unwrap_or_else(Timestamp::now);
        self.slow_since = is_slow.then_some(since);
        let is_changed = next != self.current;
        if is_changed {
            self.change(next, now);
        }
        is_changed
    }

    /// Leaves out the points whose profile replaces one that the server or a calibration names.
    fn keep_profile(&mut self) {
        let every = self.every();
        self.points.retain(|point| !point.is_fast);
        let same = self.points.iter().position(|point| point.every == every);
        self.current = same.unwrap_or(self.points.len() - 1);
    }

    /// Returns the best point at which searches are short enough, if they take this long now.
    fn choose(&self, took: Duration, now: Instant) -> usize {
        let current = self.points[self.current];
        let fits = |point: &OperatingPoint, share: f64| {
            let factor = match (current.is_fast, point.is_fast) {
                (true, false) => COST_OF_DEFAULT,
                (false, true) => COST_OF_DEFAULT.recip(),
                _ => 1.0,
            };
            took.mul_f64(factor) <= point.every.mul_f64(MAX_INTERVALS * share)
        };
        let may_rise = now.duration_since(self.since) >= self.hold;
        let better = self.points[..self.current].iter();
        let better = better.enumerate().find(|(_, point)| fits(point, MARGIN));
        if let (Some((index, _)), true) = (better, may_rise) {
            return index;
        }
        let others = self.points.iter().enumerate().skip(self.current);
        let mut fitting = others.filter(|(_, point)| fits(point, 1.0));
        let fitting = fitting.next().map(|(index, _)| index);
        fitting.unwrap_or(self.points.len() - 1)
    }

    fn change(&mut self, next: usize, now: Instant) {
        let is_better = next < self.current;
        if is_better {
            self.hold = self.hold.max(HOLD);
        } else if now.duration_since(self.since) < 2 * self.hold {
            self.hold = (2 * self.hold).min(MAX_HOLD);
        } else {
            self.hold = HOLD;
        }
        self.current = next;
        self.since = now;
        self.searches.clear();
        self.is_warm = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BALANCED: u64 = 26;

    /// A camera on a machine whose search takes so many milliseconds with `fast`.
    struct Machine {
        governor: Governor,
        now: Instant,
    }

    impl Machine {
        fn new(has_profile: bool, every_millis: Option<u64>) -> Self {
            let every = every_millis.map(Duration::from_millis);
            let now = Instant::now();
            let points = OperatingPoints::new(has_profile, every, true);
            Self {
                governor: Governor::new(&points, now),
                now,
            }
        }

        /// Runs for a minute, and returns the profile and the interval at its end, milliseconds.
        fn minute(&mut self, fast_millis: u64) -> (Option<&'static str>, u128) {
            let ends = self.now + Duration::from_mins(1);
            while self.now < ends {
                let is_fast = self.governor.profile().is_some();
                let factor = if is_fast { 10 } else { BALANCED };
                let took = Duration::from_millis(fast_millis * factor / 10);
                self.now += took.max(self.governor.every());
                let search = FinishedSearch {
                    profile: if is_fast { FAST } else { "balanced" }.to_owned(),
                    is_profile_named: false,
                    took,
                };
                self.governor.record(search, self.now);
            }
            let every = self.governor.every().as_millis();
            (self.governor.profile(), every)
        }
    }

    #[test]
    fn profile_and_rate_follow_the_time_of_searches() {
        for (fast_millis, expected) in [
            (60, (None, 200)),
            (150, (Some(FAST), 200)),
            (300, (None, 1000)),
            (700, (Some(FAST), 1000)),
            (4000, (Some(FAST), 1000)),
        ] {
            let mut machine = Machine::new(false, None);
            assert_eq!(machine.minute(fast_millis), expected, "{fast_millis}");
        }
    }

    #[test]
    fn load_that_ends_is_forgotten_within_two_minutes() {
        let mut machine = Machine::new(false, None);
        let before = machine.minute(150);
        assert_eq!(machine.minute(900), (Some(FAST), 1000));
        assert!(machine.governor.choice().unwrap().warning().is_some());
        machine.minute(150);
        assert_eq!(machine.minute(150), before);
        assert_eq!(machine.governor.choice().unwrap().warning(), None);
    }

    #[test]
    fn named_profile_and_rate_are_kept() {
        let mut machine = Machine::new(true, Some(200));
        for fast_millis in [30, 5000, 30] {
            assert_eq!(machine.minute(fast_millis), (None, 200));
        }
        let mut of_profile = Machine::new(true, None);
        assert_eq!(of_profile.minute(300), (None, 1000));
        let mut of_rate = Machine::new(false, Some(200));
        assert_eq!(of_rate.minute(300), (Some(FAST), 200));
    }

    #[test]
    fn profile_of_the_server_is_kept_if_it_is_a_setting() {
        let mut machine = Machine::new(false, None);
        assert_eq!(machine.governor.profile(), None, "the report names it");
        let search = FinishedSearch {
            profile: "quality".to_owned(),
            is_profile_named: true,
            took: Duration::from_secs(3),
        };
        machine.governor.record(search, machine.now);
        assert_eq!(machine.governor.profile(), None);
        assert_eq!(machine.minute(2000), (None, 1000));
    }

    #[test]
    fn sources_of_single_images_keep_a_frame_a_second() {
        let points = OperatingPoints::new(false, None, false);
        assert_eq!(points.shortest_interval(), Duration::from_secs(1));
    }
}
