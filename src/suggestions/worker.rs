//! The thread that finds lenses and heights.
//!
//! The observed cameras and the findings about them.

use std::{
    collections::BTreeMap,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Arc, mpsc::Receiver},
};

use lookdown_calibration::{Calibration, CalibrationId, export::Target, native::NativeCalibration};
use lookdown_imaging::{
    decode::{DecodeLimits, decode},
    room_fit::{RoomFrame, fit_room},
};
use lookdown_lens::self_calibration::{
    CameraHeight, FitRefusal, HeightRefusal, KnownCamera, RoomFit,
};
use parking_lot::Mutex;

use super::observed::{FRAMES, Observed, Subject};
use crate::{
    calibration_store::{Calibrations, Reading, WriteCondition},
    room_calibration::{checked, may_set_height, room_calibration, set_height},
};

/// A low priority: frames that are answered come first. At the lowest one, a busy machine would not
/// end a fit for minutes.
const NICE: i32 = 10;

/// Work of the thread.
pub(super) enum Work {
    /// An encoded frame of a camera.
    Frame(CalibrationId, Vec<u8>),
    /// New people of a camera.
    People(CalibrationId),
}

/// The thread that finds lenses and heights, one after the other.
pub(super) struct Worker(pub(super) Arc<Shared>);

impl Worker {
    /// Works until the sender is gone.
    pub(super) fn run(self, waiting: &Receiver<Work>) {
        // Of this thread alone, on Linux.
        if let Err(error) = rustix::process::setpriority_process(None, NICE) {
            tracing::warn!("calibrations are found without a lower priority: {error}");
        }
        for work in waiting {
            // A defect that a frame of one camera shows does not end the thread for all.
            if catch_unwind(AssertUnwindSafe(|| self.work(work))).is_err() {
                tracing::error!("the search for a calibration panicked");
            }
        }
    }

    fn work(&self, work: Work) {
        let camera = match work {
            Work::Frame(camera, image) => {
                self.fit(&camera, &image);
                camera
            }
            Work::People(camera) => camera,
        };
        self.measure_height(&camera);
        self.apply(&camera);
    }

    /// Fits the lens to this frame and the frames before.
    fn fit(&self, camera: &CalibrationId, image: &[u8]) {
        // A frame that was detected can be decoded.
        let Ok(decoded) = decode(image, &self.0.limits) else {
            return;
        };
        let edges = RoomFrame::new(&decoded.frame);
        drop(decoded);
        let mut cameras = self.0.cameras.lock();
        let Some(observed) = cameras.get_mut(camera) else {
            return;
        };
        let frames = observed.add_frame(edges);
        drop(cameras);
        if frames.is_empty() {
            return;
        }
        let fit = fit_room(&frames, self.0.known);
        let size = frames[0].size();
        let mut cameras = self.0.cameras.lock();
        let observed = cameras.get_mut(camera);
        // Meanwhile, frames of another camera may have this name, or a calibration was stored.
        let is_same = |observed: &&mut Observed| {
            observed.frame_size() == size && *observed.subject() == Subject::Lens
        };
        if let Some(observed) = observed.filter(is_same) {
            if let Ok(fit) = &fit {
                tracing::info!(
                    %camera,
                    "a lens of {:.0}° was found from {} of {FRAMES} frames",
                    2.0 * fit.max_theta.to_degrees(),
                    frames.len()
                );
            }
            observed.fit = Some(fit);
            if observed.is_complete() {
                observed.forget_frames();
            }
        }
    }

    /// Finds the height of a camera whose lens is known.
    pub(super) fn measure_height(&self, camera: &CalibrationId) {
        let Some(known) = self.0.known_camera(camera) else {
            return;
        };
        let people = self.0.cameras.lock().get(camera).map(Observed::people);
        let Some(people) = people.filter(|people| !people.is_empty()) else {
            return;
        };
        let height = CameraHeight::from_people(&people, known.lens(), known.mount());
        if let Some(observed) = self.0.cameras.lock().get_mut(camera) {
            observed.height = Some(height);
        }
    }

    /// Stores the calibration of a camera that has none, if the settings permit it.
    pub(super) fn apply(&self, camera: &CalibrationId) {
        let is_complete = |shared: &Shared| {
            let cameras = shared.cameras.lock();
            cameras.get(camera).is_some_and(Observed::is_complete)
        };
        if !self.0.applies || !is_complete(&self.0) {
            return;
        }
        let found = self.0.suggestion(camera);
        let Some(native) = found.and_then(|found| found.calibration) else {
            return;
        };
        let written = match Target::Native.write(&native) {
            Ok(written) => written.content,
            Err(error) => return tracing::warn!(%camera, "the calibration is not stored: {error}"),
        };
        let put = self.0.calibrations.put(
            camera,
            written.as_bytes(),
            &Reading::default(),
            &WriteCondition::IfAbsent,
        );
        match put {
            Ok(_) => tracing::info!(%camera, "the calibration that was found is in use"),
            Err(error) => tracing::warn!(%camera, "the calibration is not stored: {error}"),
        }
    }
}

/// The parts that the thread uses, too.
pub(super) struct Shared {
    pub cameras: Mutex<BTreeMap<CalibrationId, Observed>>,
    pub calibrations: Arc<Calibrations>,
    pub limits: DecodeLimits,
    /// The known values of all cameras without a calibration.
    pub known: KnownCamera,
    /// True if a calibration from all frames is stored without a request.
    pub applies: bool,
}

/// The findings about a camera.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Suggestion {
    /// The number of frames of the lens.
    pub frames: usize,
    /// The lens, or the reason why the frames do not determine it. `None` before the first frame,
    /// and for a camera with a calibration, which lacks the height only.
    pub fit: Option<Result<RoomFit, FitRefusal>>,
    /// The height, or the reason why the people do not determine it.
    pub height: Option<Result<CameraHeight, HeightRefusal>>,
    /// The calibration, if there is one to store.
    pub calibration: Option<NativeCalibration>,
    /// The revision of the calibration that it replaces.
    pub replaces: Option<String>,
}

impl Shared {
    /// The findings about a camera, if it is observed.
    pub(super) fn suggestion(&self, camera: &CalibrationId) -> Option<Suggestion> {
        let cameras = self.cameras.lock();
        let observed = cameras.get(camera)?;
        let (size, subject) = (observed.size(), observed.subject().clone());
        let (fit, height) = (observed.fit.clone(), observed.height);
        let frames = observed.frame_count();
        drop(cameras);
        let (base, replaces) = match &subject {
            Subject::Lens => {
                let found = fit.as_ref().and_then(|fit| fit.as_ref().ok());
                let native = found.map(|fit| room_calibration(camera, size, fit, self.known));
                (native, None)
            }
            Subject::Height(id) => {
                let entry = self.calibrations.entry(id)?;
                let revision = entry.calibration.revision().to_owned();
                // A height may have been given since the last frame.
                let is_found = matches!(height, Some(Ok(_))) && may_set_height(&entry.native);
                let native = is_found.then(|| entry.native.clone());
                (native, Some(revision))
            }
        };
        let calibration = base.map(|mut native: NativeCalibration| {
            if let Some(Ok(height)) = &height {
                set_height(&mut native, height);
            }
            native
        });
        let replaces = replaces.filter(|_| calibration.is_some());
        Some(Suggestion {
            frames,
            fit,
            height,
            calibration,
            replaces,
        })
    }

    /// The camera of the calibration in use, or that of the lens that was found.
    pub(super) fn known_camera(&self, camera: &CalibrationId) -> Option<Arc<Calibration>> {
        let cameras = self.cameras.lock();
        let observed = cameras.get(camera)?;
        match observed.subject() {
            Subject::Height(id) => {
                let entry = self.calibrations.entry(id)?;
                Some(Arc::clone(&entry.calibration))
            }
            Subject::Lens => {
                let fit = observed.fit.as_ref()?.as_ref().ok()?;
                let native = room_calibration(camera, observed.size(), fit, self.known);
                checked(&native).ok().map(Arc::new)
            }
        }
    }
}
