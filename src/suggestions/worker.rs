//! The thread that finds lenses and heights.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Arc, mpsc::Receiver},
};

use lookdown_calibration::{CalibrationId, export::Target};
use lookdown_imaging::{
    decode::decode,
    room_fit::{RoomFrame, fit_room},
};
use lookdown_lens::self_calibration::CameraHeight;

use super::{
    observed::{FRAMES, Observed, Subject},
    shared::Shared,
};
use crate::calibration_store::{Reading, WriteCondition};

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
