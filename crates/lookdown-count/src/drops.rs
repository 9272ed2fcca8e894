//! Reports that were not counted, by camera.

use std::{
    collections::BTreeMap,
    fmt,
    time::{Duration, Instant},
};

use lookdown_common::{OwnCameras, Place, makes_room, text::one_line};

use crate::now::{LogPause, Now};

/// Most cameras of which dropped reports are known, beside those of this process.
const MAX_CAMERAS: usize = 256;
/// Pause between two log lines about one camera.
const LOG_PAUSE: Duration = Duration::from_hours(1);

/// The dropped reports of all cameras.
#[derive(Debug, Default)]
pub(crate) struct Drops {
    cameras: BTreeMap<String, CameraDrops>,
    /// The log lines about cameras beyond the limit, whose names clients choose.
    limit_log: LogPause,
}

/// The dropped reports of a camera.
#[derive(Debug)]
pub(crate) struct CameraDrops {
    /// Reports since the start.
    pub(crate) reports: u64,
    /// Time of the first one since the last counted report, milliseconds since the Unix epoch.
    pub(crate) since_ms: Option<i64>,
    /// The reason of the last one.
    pub(crate) reason: DropReason,
    last: Instant,
    log: LogPause,
}

/// The reason why a report is not counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum DropReason {
    /// The server sent the report before.
    Repeated,
    /// The report is older than others of its camera or site.
    OutOfOrder,
    /// The report is of a camera beyond the limit.
    TooManyCameras,
}

impl DropReason {
    /// Returns the label of the metric.
    pub(crate) fn label(self) -> &'static str {
        match self {
            Self::Repeated => "repeated",
            Self::OutOfOrder => "out_of_order",
            Self::TooManyCameras => "too_many_cameras",
        }
    }
}

impl fmt::Display for DropReason {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Repeated => "the server sends reports again that were counted",
            Self::OutOfOrder => {
                "its times go back, or are later than those of other cameras of its site: set the clocks"
            }
            Self::TooManyCameras => "there are too many cameras: raise counts.max_cameras",
        })
    }
}

impl Drops {
    /// Adds a dropped report. Logs the first one of a camera, and at most one per hour.
    pub(crate) fn add(&mut self, camera: &str, reason: DropReason, own: &OwnCameras, now: Now) {
        if self.cameras.len() >= MAX_CAMERAS && !self.cameras.contains_key(camera) {
            let places = self.cameras.iter().map(|(name, drops)| Place {
                camera: name.clone(),
                claim: own.claim(name, false),
                last: drops.last,
                is_silent: true,
            });
            if let Some(oldest) = makes_room(own.claim(camera, false), places) {
                self.cameras.remove(&oldest);
            }
        }
        let entry = self.cameras.entry(camera.to_owned());
        let drops = entry.or_insert_with(|| CameraDrops {
            reports: 0,
            since_ms: None,
            reason,
            last: now.instant,
            log: LogPause::default(),
        });
        drops.reports += 1;
        drops.since_ms = drops.since_ms.or(Some(now.unix_ms));
        (drops.reason, drops.last) = (reason, now.instant);
        let log = match reason {
            DropReason::TooManyCameras => &mut self.limit_log,
            _ => &mut drops.log,
        };
        if log.is_over(LOG_PAUSE, now) {
            let camera = one_line(camera);
            tracing::warn!(camera, "a report is not counted: {reason}");
        }
    }

    /// Records that a report of the camera was counted.
    pub(crate) fn end(&mut self, camera: &str) {
        if let Some(drops) = self.cameras.get_mut(camera) {
            drops.since_ms = None;
        }
    }

    /// Forgets a camera.
    pub(crate) fn remove(&mut self, camera: &str) {
        self.cameras.remove(camera);
    }

    /// Returns the dropped reports of each camera.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (&str, &CameraDrops)> {
        let cameras = self.cameras.iter();
        cameras.map(|(name, drops)| (name.as_str(), drops))
    }

    /// Returns the reason why the reports of a camera are not counted now, as a sentence.
    pub(crate) fn reason(&self, camera: &str) -> Option<String> {
        let drops = self
            .for_camera(camera)
            .filter(|drops| drops.since_ms.is_some())?;
        Some(format!("its reports are not counted: {}", drops.reason))
    }

    /// Returns the dropped reports of a camera.
    pub(crate) fn for_camera(&self, camera: &str) -> Option<&CameraDrops> {
        self.cameras.get(camera)
    }
}
