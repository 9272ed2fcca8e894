//! Reference counts: the numbers of persons that people gave for frames of a camera, and the number
//! of the camera that they teach.
//!
//! A file for each camera in the state folder has numbers, scores and times, and no images.

use std::{
    collections::BTreeMap,
    fs, io,
    path::{Path, PathBuf},
    sync::Arc,
};

use jiff::{SignedDuration, Timestamp};
use lookdown_calibration::revision::revision_of;
use lookdown_common::files;
use lookdown_tracking::taught::{
    MAX_FRAMES, MIN_FRAMES, NumberWithBar, ReferenceFrame, TaughtNumber,
};
use parking_lot::{Mutex, RwLock};
use serde::{Deserialize, Serialize};

use crate::cameras::{CameraError, StateFolder};

/// The folder of the files in the state folder.
const FOLDER: &str = "reference-counts";
const VERSION: u8 = 1;
/// Most cameras with reference counts.
const MAX_CAMERAS: usize = 256;
/// Most bytes of a file: more than any has.
const MAX_BYTES: u64 = 1 << 20;
/// Most persons of a reference count.
pub const MAX_PERSONS: u32 = 1000;
/// Most scores of a frame; the highest are kept.
const MAX_SCORES: usize = 1000;
/// Reference counts of this age no longer count: rooms and seasons change.
const MAX_AGE_DAYS: i64 = 180;
/// Reference counts in a row within this time have the same light and the same people.
const SAME_TIME: SignedDuration = SignedDuration::from_mins(10);

/// The number of persons that a person gave for a frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReferenceCount {
    /// The ID of the report of the frame.
    pub report: String,
    /// The time of the report.
    pub at: Timestamp,
    /// The number of persons in the frame.
    pub persons: u32,
    /// The scores of the boxes in the frame.
    pub scores: Vec<f32>,
}

/// A failure to store a reference count.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// There are too many cameras.
    #[error("{MAX_CAMERAS} cameras have reference counts: delete those of another camera first")]
    Full,
    /// The file cannot be written.
    #[error(transparent)]
    Unwritable(#[from] CameraError),
}

/// The reference counts of one camera, oldest first, and the number that they teach.
#[derive(Debug, Default)]
struct Taught {
    counts: Vec<ReferenceCount>,
    number: Option<Arc<TaughtNumber>>,
}

/// The content of a file.
#[derive(Serialize, Deserialize)]
struct Content {
    version: u8,
    camera: String,
    counts: Vec<ReferenceCount>,
}

/// The reference counts of all cameras.
#[derive(Debug, Default)]
pub struct ReferenceCounts {
    /// `None`: nothing is stored.
    folder: Option<StateFolder>,
    cameras: RwLock<BTreeMap<String, Taught>>,
    /// Locked while a file is changed.
    changing: Mutex<()>,
}

impl ReferenceCounts {
    /// Reads the reference counts in a state folder, which may be missing. A file that is none is
    /// logged and left out. Blocks.
    pub fn open(state: &Path, now: Timestamp) -> Self {
        let folder = state.join(FOLDER);
        let mut cameras = BTreeMap::new();
        let entries = fs::read_dir(&folder).into_iter().flatten().flatten();
        let paths = entries.map(|entry| entry.path());
        let is_file = |path: &PathBuf| path.extension().is_some_and(|ending| ending == "json");
        for path in paths.filter(is_file).take(MAX_CAMERAS) {
            match read(&path) {
                Ok(content) => {
                    let taught = Taught::new(content.counts, now);
                    if !taught.counts.is_empty() {
                        cameras.insert(content.camera, taught);
                    }
                }
                Err(error) => tracing::warn!(
                    "state.path: {}: {error}: it is not used: delete it, or restore a copy",
                    path.display()
                ),
            }
        }
        Self {
            folder: Some(StateFolder::new(state.to_owned())),
            cameras: RwLock::new(cameras),
            changing: Mutex::default(),
        }
    }

    /// Returns the reference counts of a camera that still count, oldest first.
    pub fn counts(&self, camera: &str, now: Timestamp) -> Vec<ReferenceCount> {
        let cameras = self.cameras.read();
        let counts = cameras.get(camera).map(|taught| taught.counts.clone());
        let mut counts = counts.unwrap_or_default();
        counts.retain(|count| !is_old(count, now));
        counts
    }

    /// Returns the number of a camera with enough reference counts.
    pub fn number(&self, camera: &str) -> Option<Arc<TaughtNumber>> {
        self.cameras.read().get(camera)?.number.clone()
    }

    /// Adds a reference count, or replaces that of the same report; the oldest ones make room.
    /// Returns false if it replaces one. Blocks.
    ///
    /// # Errors
    /// [`ReferenceError`].
    pub fn put(
        &self,
        camera: &str,
        mut new: ReferenceCount,
        now: Timestamp,
    ) -> Result<bool, ReferenceError> {
        let _changing = self.changing.lock();
        let (_locked, mut counts) = self.stored(camera, now)?;
        if counts.is_empty() && self.cameras.read().len() >= MAX_CAMERAS {
            return Err(ReferenceError::Full);
        }
        new.scores.sort_by(|one, other| other.total_cmp(one));
        new.scores.truncate(MAX_SCORES);
        let before = counts.len();
        counts.retain(|count| count.report != new.report);
        let is_new = counts.len() == before;
        counts.push(new);
        counts.sort_by_key(|count| count.at);
        let surplus = counts.len().saturating_sub(MAX_FRAMES);
        counts.drain(..surplus);
        self.store(camera, counts, now)?;
        Ok(is_new)
    }

    /// Deletes the reference count of a report. Returns false if there is none. Blocks.
    ///
    /// # Errors
    /// [`ReferenceError`].
    pub fn delete(
        &self,
        camera: &str,
        report: &str,
        now: Timestamp,
    ) -> Result<bool, ReferenceError> {
        let _changing = self.changing.lock();
        let (_locked, mut counts) = self.stored(camera, now)?;
        let before = counts.len();
        counts.retain(|count| count.report != report);
        if counts.len() == before {
            return Ok(false);
        }
        self.store(camera, counts, now)?;
        Ok(true)
    }

    /// Deletes all reference counts of a camera. Blocks.
    ///
    /// # Errors
    /// [`ReferenceError`].
    pub fn forget(&self, camera: &str, now: Timestamp) -> Result<(), ReferenceError> {
        let _changing = self.changing.lock();
        let (_locked, counts) = self.stored(camera, now)?;
        if !counts.is_empty() {
            self.store(camera, Vec::new(), now)?;
        }
        Ok(())
    }

    /// Locks the files against other processes, and returns the reference counts of a camera that
    /// still count.
    fn stored(
        &self,
        camera: &str,
        now: Timestamp,
    ) -> Result<(Option<fs::File>, Vec<ReferenceCount>), ReferenceError> {
        let Some(folder) = &self.folder else {
            return Ok((None, self.counts(camera, now)));
        };
        let locked = folder.lock()?;
        let content = read(&folder.file(&file_of(camera)));
        let mut counts = content.map_or_else(|_| Vec::new(), |content| content.counts);
        counts.retain(|count| !is_old(count, now));
        Ok((Some(locked), counts))
    }

    /// Writes the reference counts of a camera, and learns from them.
    fn store(
        &self,
        camera: &str,
        counts: Vec<ReferenceCount>,
        now: Timestamp,
    ) -> Result<(), ReferenceError> {
        if let Some(folder) = &self.folder {
            let path = folder.file(&file_of(camera));
            if counts.is_empty() {
                StateFolder::remove(&path)?;
            } else {
                let content = Content {
                    version: VERSION,
                    camera: camera.to_owned(),
                    counts: counts.clone(),
                };
                folder.write(&path, &serde_json::to_string(&content).unwrap_or_default())?;
            }
        }
        let mut cameras = self.cameras.write();
        if counts.is_empty() {
            cameras.remove(camera);
        } else {
            cameras.insert(camera.to_owned(), Taught::new(counts, now));
        }
        Ok(())
    }
}

impl Taught {
    fn new(mut counts: Vec<ReferenceCount>, now: Timestamp) -> Self {
        counts.retain(|count| !is_old(count, now));
        let frames: Vec<_> = counts
            .iter()
            .map(|count| ReferenceFrame {
                persons: count.persons,
                scores: count.scores.clone(),
            })
            .collect();
        let number = TaughtNumber::new(&frames).map(Arc::new);
        Self { counts, number }
    }
}

/// Returns the reason why a reference count of a frame with this time and number would help, if it
/// would.
pub fn good_moment(
    counts: &[ReferenceCount],
    now: Timestamp,
    number: NumberWithBar,
) -> Option<&'static str> {
    let persons = number.persons;
    if counts.len() < MIN_FRAMES {
        return Some("few");
    }
    let last = counts.last()?;
    if now.duration_since(last.at) < SAME_TIME {
        return None;
    }
    let given = || counts.iter().map(|count| count.persons as usize);
    if given().max().is_some_and(|most| persons > most) {
        return Some("busy");
    }
    if given().min().is_some_and(|least| persons < least) {
        return Some("empty");
    }
    // Reference counts at other hours (UTC) have another light.
    let hour = |at: Timestamp| at.as_second().div_euclid(3600).rem_euclid(24);
    let hours_apart = |at: Timestamp| {
        let apart = (hour(now) - hour(at)).abs();
        apart.min(24 - apart)
    };
    if counts.iter().all(|count| hours_apart(count.at) > 2) {
        return Some("other_hour");
    }
    (number.high - number.low > persons.max(4)).then_some("unsure")
}

/// Returns the file of a camera in the state folder.
fn file_of(camera: &str) -> String {
    format!("{FOLDER}/{}.json", revision_of(camera.as_bytes()))
}

fn is_old(count: &ReferenceCount, now: Timestamp) -> bool {
    now.duration_since(count.at) > SignedDuration::from_hours(24 * MAX_AGE_DAYS)
}

fn read(path: &Path) -> io::Result<Content> {
    let json = files::read(path, MAX_BYTES)?;
    let content: Content = serde_json::from_slice(&json)?;
    if content.version != VERSION {
        let problem = format!("version {} is not {VERSION}", content.version);
        return Err(io::Error::other(problem));
    }
    Ok(content)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(report: u32, age_days: i64) -> ReferenceCount {
        ReferenceCount {
            report: report.to_string(),
            at: now() - SignedDuration::from_hours(24 * age_days),
            persons: 3,
            scores: vec![0.9, 0.8, 0.1],
        }
    }

    fn now() -> Timestamp {
        "2026-11-28T12:00:00Z".parse().unwrap()
    }

    #[test]
    fn reference_counts_survive_a_restart_and_age() {
        let folder = tempfile::tempdir().unwrap();
        let counts = ReferenceCounts::open(folder.path(), now());
        for report in 0..5 {
            assert!(counts.put("hall", count(report, 1), now()).unwrap());
            assert_eq!(counts.number("hall").is_some(), report == 4);
        }
        assert!(!counts.put("hall", count(4, 1), now()).unwrap());
        let read = ReferenceCounts::open(folder.path(), now());
        assert_eq!(read.counts("hall", now()), counts.counts("hall", now()));
        assert!(read.number("hall").is_some());
        let later = now() + SignedDuration::from_hours(24 * MAX_AGE_DAYS);
        assert!(
            ReferenceCounts::open(folder.path(), later)
                .number("hall")
                .is_none()
        );
        assert!(read.delete("hall", "4", now()).unwrap());
        assert!(!read.delete("hall", "4", now()).unwrap());
        assert!(read.number("hall").is_none());
        read.forget("hall", now()).unwrap();
        assert!(
            ReferenceCounts::open(folder.path(), now())
                .counts("hall", now())
                .is_empty()
        );
    }

    #[test]
    fn reference_counts_of_two_processes_are_all_stored() {
        let folder = tempfile::tempdir().unwrap();
        let [one, other] = [(); 2].map(|()| ReferenceCounts::open(folder.path(), now()));
        for (counts, report) in [(&one, 1), (&other, 2), (&one, 3)] {
            assert!(counts.put("hall", count(report, 1), now()).unwrap());
        }
        assert_eq!(one.counts("hall", now()).len(), 3);
        assert!(other.delete("hall", "3", now()).unwrap());
    }

    #[test]
    fn reference_counts_and_cameras_are_bounded() {
        let counts = ReferenceCounts::default();
        for report in 0..70 {
            counts
                .put("hall", count(report, 70 - i64::from(report)), now())
                .unwrap();
        }
        let kept = counts.counts("hall", now());
        assert_eq!((kept.len(), kept[0].report.as_str()), (MAX_FRAMES, "10"));
        for camera in 1..MAX_CAMERAS {
            counts.put(&camera.to_string(), count(1, 1), now()).unwrap();
        }
        let refused = counts.put("another", count(1, 1), now()).unwrap_err();
        assert!(refused.to_string().starts_with("256 cameras"), "{refused}");
    }

    #[test]
    fn good_moments_differ_from_earlier_ones() {
        let counts: Vec<_> = (0..5).map(|report| count(report, 1)).collect();
        let moment = |persons, hours, width| {
            let number = NumberWithBar {
                persons,
                low: 0,
                high: width,
            };
            good_moment(&counts, now() + SignedDuration::from_hours(hours), number)
        };
        assert_eq!(
            good_moment(&counts[..4], now(), NumberWithBar::untaught(3)),
            Some("few")
        );
        assert_eq!(moment(3, 0, 1), None);
        assert_eq!(moment(4, 0, 1), Some("busy"));
        assert_eq!(moment(2, 0, 1), Some("empty"));
        assert_eq!(moment(3, 6, 1), Some("other_hour"));
        assert_eq!(moment(3, 0, 9), Some("unsure"));
        let fresh = [counts.as_slice(), &[count(9, 0)]].concat();
        assert_eq!(good_moment(&fresh, now(), NumberWithBar::untaught(9)), None);
    }
}
