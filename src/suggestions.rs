//! Calibrations that the server finds for named cameras from their own frames and people, and
//! offers.
//!
//! Frames of different times become edges (`RoomFrame`) on one thread of a low priority, one
//! frame at a time. Neither frames nor images of people are kept.

#[cfg(test)]
mod tests;
mod worker;

use std::{
    collections::BTreeMap,
    sync::{
        Arc, OnceLock,
        mpsc::{SyncSender, sync_channel},
    },
    thread,
    time::{Duration, Instant},
};

use lookdown_calibration::CalibrationId;
use lookdown_common::{Claim, OwnCameras, Place, makes_room};
use lookdown_detect::pipeline::DetectedFrame;
use lookdown_imaging::decode::DecodeLimits;
use lookdown_lens::self_calibration::{IdealLens, KnownCamera};
use parking_lot::Mutex;

use crate::calibration_store::Calibrations;
use worker::Shared;
use worker::{Observed, Subject};
use worker::{Work, Worker};

pub(crate) use worker::{FRAMES, Suggestion};

/// Most cameras that are observed, beside those of this process. One that is silent makes room for
/// a new one.
const MAX_CAMERAS: usize = 32;
/// A camera without a frame for so long is silent.
const SILENCE: Duration = Duration::from_mins(10);
/// Work that waits for the thread. Further frames are skipped: later ones will do.
const MAX_WAITING: usize = 2;

/// The observed cameras.
pub(crate) struct Suggestions {
    shared: Arc<Shared>,
    own: OwnCameras,
    /// The thread, started for the first frame. `None` if the operating system gives none.
    worker: OnceLock<Option<SyncSender<Work>>>,
}

impl Suggestions {
    /// Creates the suggestions for cameras without one of these calibrations, whose lens may be
    /// known. With `applies`, a calibration from all frames is stored.
    pub(crate) fn new(
        calibrations: Arc<Calibrations>,
        limits: DecodeLimits,
        lens: Option<IdealLens>,
        applies: bool,
        own: OwnCameras,
    ) -> Self {
        let shared = Shared {
            cameras: Mutex::default(),
            calibrations,
            limits,
            known: KnownCamera {
                lens,
                ..KnownCamera::default()
            },
            applies,
        };
        Self {
            shared: Arc::new(shared),
            own,
            worker: OnceLock::new(),
        }
    }

    /// Takes what a suggestion needs from a frame, if it is due. Does not wait.
    pub(crate) fn observe(&self, detected: &DetectedFrame, now: Instant) {
        let report = &detected.report;
        let Ok(camera) = report.camera.parse::<CalibrationId>() else {
            return;
        };
        let Some(subject) = self.subject(detected) else {
            self.shared.cameras.lock().remove(&camera);
            return;
        };
        let size = (report.image_width, report.image_height);
        let standing = report.persons.iter().filter(|person| !person.lies());
        let boxes = standing.map(|person| person.oriented_box);
        let mut cameras = self.shared.cameras.lock();
        let is_full = !cameras.contains_key(&camera) && cameras.len() >= MAX_CAMERAS;
        if is_full && !make_room(&mut cameras, &camera, &self.own, now) {
            return;
        }
        let observed = cameras.entry(camera.clone()).or_default();
        observed.see(subject, size, now);
        if observed.add_people(boxes, now) {
            self.send(Work::People(camera.clone()));
        }
        if let Some(encoded) = &detected.encoded
            && observed.is_frame_due(now)
            // A copy: the memory of the upload is not held while the frame waits.
            && self.send(Work::Frame(camera, encoded.to_vec()))
        {
            observed.frame_taken(now);
        }
    }

    /// Returns the part of the calibration that a frame's camera lacks, if it lacks one.
    fn subject(&self, detected: &DetectedFrame) -> Option<Subject> {
        let report = &detected.report;
        let used = &report.calibration;
        if used.assumed_circle.is_some() {
            // A frame without a name has the name of the assumed calibration.
            return (report.camera != used.id).then_some(Subject::Lens);
        }
        let id = used.id.parse().ok()?;
        let entry = self.shared.calibrations.entry(&id)?;
        let has_height = entry.native.mount.height_m.is_some();
        (!has_height).then_some(Subject::Height(id))
    }

    /// Returns the findings about a camera, if it is observed.
    pub(crate) fn for_camera(&self, camera: &str) -> Option<Suggestion> {
        self.shared.suggestion(&camera.parse().ok()?)
    }

    /// Passes work to the thread. Returns false if it has enough.
    fn send(&self, work: Work) -> bool {
        let worker = self.worker.get_or_init(|| {
            let (sender, waiting) = sync_channel(MAX_WAITING);
            let worker = Worker(Arc::clone(&self.shared));
            let started = thread::Builder::new()
                .name("calibration-fit".to_owned())
                .spawn(move || worker.run(&waiting));
            match started {
                Ok(_) => Some(sender),
                Err(error) => {
                    tracing::warn!("no calibrations are suggested: {error}");
                    None
                }
            }
        });
        worker
            .as_ref()
            .is_some_and(|worker| worker.try_send(work).is_ok())
    }
}

/// Makes room for a camera. Returns false if it has no place.
fn make_room(
    cameras: &mut BTreeMap<CalibrationId, Observed>,
    newcomer: &CalibrationId,
    own: &OwnCameras,
    now: Instant,
) -> bool {
    let is_silent = |seen_at: Instant| now.saturating_duration_since(seen_at) >= SILENCE;
    let places = cameras.iter().map(|(camera, observed)| Place {
        camera: camera.clone(),
        claim: own.claim(camera.as_str(), false),
        last: observed.seen_at,
        is_silent: observed.seen_at.is_none_or(is_silent),
    });
    let claim = own.claim(newcomer.as_str(), false);
    let displaced = makes_room(claim, places);
    displaced.is_some_and(|camera| cameras.remove(&camera).is_some()) || claim == Claim::Own
}
