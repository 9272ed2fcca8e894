//! The thread that finds lenses and heights.
//!
//! The observed cameras and the findings about them.
//!
//! The frames and people of one camera.

use std::{
    collections::{BTreeMap, VecDeque},
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Arc, mpsc::Receiver},
    time::{Duration, Instant},
};

use lookdown_calibration::{
    Calibration, CalibrationId,
    export::Target,
    native::{NativeCalibration, NativeImage},
};
use lookdown_imaging::{
    decode::{DecodeLimits, decode},
    room_fit::{RoomFrame, fit_room},
};
use lookdown_lens::{
    geometry::OrientedBox,
    self_calibration::{CameraHeight, FitRefusal, HeightRefusal, KnownCamera, RoomFit},
};
use parking_lot::Mutex;

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
            observed.frame_size() == size && observed.subject == Subject::Lens
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
        let (size, subject) = (observed.size(), observed.subject.clone());
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
        match &observed.subject {
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

/// Pauses before the frames: the first is taken at once, the last an hour later.
const PAUSES: [Duration; 5] = [
    Duration::ZERO,
    Duration::from_mins(2),
    Duration::from_mins(8),
    Duration::from_mins(20),
    Duration::from_mins(30),
];
/// The number of frames of a lens.
pub(crate) const FRAMES: usize = PAUSES.len();
/// Least pause between two frames, even if their size changes.
const LEAST_PAUSE: Duration = Duration::from_mins(2);
/// Pause before a further frame while the frames are refused: it replaces the oldest.
const RETRY: Duration = Duration::from_hours(1);
/// Pause between two frames whose people are taken.
const PEOPLE_PAUSE: Duration = Duration::from_secs(30);
/// Most boxes of people: of some hours. The newest replace the oldest.
const MAX_PEOPLE: usize = 400;

/// The part of the calibration that a camera lacks.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) enum Subject {
    /// All: lens, center, level and height.
    #[default]
    Lens,
    /// The height, in the calibration of this ID.
    Height(CalibrationId),
}

/// The frames and people of one camera, and the findings.
#[derive(Debug, Default)]
pub(super) struct Observed {
    pub(super) subject: Subject,
    size: (u32, u32),
    pub(super) seen_at: Option<Instant>,
    frames: VecDeque<RoomFrame>,
    /// The number of frames that were taken.
    taken: usize,
    last_frame: Option<Instant>,
    people: VecDeque<OrientedBox>,
    last_people: Option<Instant>,
    pub fit: Option<Result<RoomFit, FitRefusal>>,
    pub height: Option<Result<CameraHeight, HeightRefusal>>,
}

impl Observed {
    /// Notes a frame. Frames of another size are those of another camera, and a camera that got a
    /// calibration needs no frames.
    pub(super) fn see(&mut self, subject: Subject, size: (u32, u32), now: Instant) {
        if self.size != size {
            *self = Self {
                last_frame: self.last_frame,
                ..Self::default()
            };
        }
        if self.subject != subject {
            self.forget_frames();
            (self.fit, self.height, self.last_frame) = (None, None, None);
            self.taken = 0;
        }
        (self.subject, self.size, self.seen_at) = (subject, size, Some(now));
    }

    /// Width and height of the frames.
    pub(super) fn frame_size(&self) -> (u32, u32) {
        self.size
    }

    /// The size of the frames.
    pub(super) fn size(&self) -> NativeImage {
        let (width, height) = self.size;
        NativeImage { width, height }
    }

    /// Returns true if the edges of a frame of this time are needed.
    pub(super) fn is_frame_due(&self, now: Instant) -> bool {
        let pause = match PAUSES.get(self.taken) {
            Some(pause) => *pause,
            None if matches!(self.fit, Some(Err(_))) => RETRY,
            None => return false,
        };
        let is_over = |last: Instant| now.saturating_duration_since(last) >= pause.max(LEAST_PAUSE);
        self.subject == Subject::Lens && self.last_frame.is_none_or(is_over)
    }

    /// Notes that a frame of this time was taken.
    pub(super) fn frame_taken(&mut self, now: Instant) {
        self.taken += 1;
        self.last_frame = Some(now);
    }

    /// Adds the edges of a frame. Returns the edges of all.
    pub(super) fn add_frame(&mut self, frame: RoomFrame) -> Vec<RoomFrame> {
        if frame.size() == self.size && self.subject == Subject::Lens {
            if self.frames.len() == FRAMES {
                self.frames.pop_front();
            }
            self.frames.push_back(frame);
        }
        self.frames.iter().cloned().collect()
    }

    pub(super) fn frame_count(&self) -> usize {
        self.taken.min(FRAMES)
    }

    /// Returns true if the lens is found from all frames.
    pub(super) fn is_complete(&self) -> bool {
        self.taken >= FRAMES && matches!(self.fit, Some(Ok(_)))
    }

    /// Frees the memory of the edges.
    pub(super) fn forget_frames(&mut self) {
        self.frames = VecDeque::new();
    }

    /// Adds the people of a frame, if the last ones are old enough. Returns true if it did.
    pub(super) fn add_people(
        &mut self,
        boxes: impl Iterator<Item = OrientedBox>,
        now: Instant,
    ) -> bool {
        let is_recent = |last| now.saturating_duration_since(last) < PEOPLE_PAUSE;
        if self.last_people.is_some_and(is_recent) {
            return false;
        }
        let before = self.people.len();
        self.people.extend(boxes);
        if self.people.len() == before {
            return false;
        }
        self.last_people = Some(now);
        let surplus = self.people.len().saturating_sub(MAX_PEOPLE);
        self.people.drain(..surplus);
        true
    }

    pub(super) fn people(&self) -> Vec<OrientedBox> {
        self.people.iter().copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use lookdown_lens::geometry::Pixel;

    use super::*;

    const SIZE: (u32, u32) = (800, 800);

    fn person() -> OrientedBox {
        OrientedBox {
            center: Pixel::new(200.0, 300.0),
            width: 20.0,
            height: 60.0,
            angle: 0.0,
            up: nalgebra::Vector2::new(0.0, -1.0),
        }
    }

    /// Minutes at which frames are taken, of one frame each minute.
    fn taken(observed: &mut Observed, start: Instant, minutes: u64) -> Vec<u64> {
        let mut taken = Vec::new();
        for minute in 0..minutes {
            let now = start + Duration::from_mins(minute);
            observed.see(Subject::Lens, SIZE, now);
            if observed.is_frame_due(now) {
                observed.frame_taken(now);
                taken.push(minute);
            }
        }
        taken
    }

    #[test]
    fn five_frames_of_an_hour_are_taken() {
        let mut observed = Observed::default();
        let start = Instant::now();
        assert_eq!(taken(&mut observed, start, 600), [0, 2, 10, 30, 60]);
    }

    #[test]
    fn refused_frames_are_followed_by_one_each_hour() {
        let mut observed = Observed {
            fit: Some(Err(FitRefusal::Ambiguous { explained: 0.6 })),
            size: SIZE,
            ..Observed::default()
        };
        let start = Instant::now();
        let minutes = taken(&mut observed, start, 200);
        assert_eq!(minutes, [0, 2, 10, 30, 60, 120, 180]);
    }

    #[test]
    fn frames_of_another_size_start_again() {
        let mut observed = Observed::default();
        let start = Instant::now();
        taken(&mut observed, start, 5);
        observed.add_people([person()].into_iter(), start);
        observed.see(Subject::Lens, (640, 480), start);
        assert!(!observed.is_frame_due(start) && observed.people().is_empty());
        assert!(observed.is_frame_due(start + Duration::from_mins(4)));
    }

    #[test]
    fn people_stay_and_frames_go_with_a_calibration() {
        let mut observed = Observed::default();
        let start = Instant::now();
        taken(&mut observed, start, 5);
        observed.add_people([person()].into_iter(), start);
        let with_calibration = Subject::Height("hall".parse().unwrap());
        observed.see(with_calibration, SIZE, start);
        let later = start + Duration::from_hours(2);
        assert!(!observed.is_frame_due(later) && observed.people().len() == 1);
    }

    #[test]
    fn people_are_taken_at_intervals_and_bounded() {
        let mut observed = Observed::default();
        let start = Instant::now();
        let group = || std::iter::repeat_n(person(), 3);
        assert!(observed.add_people(group(), start));
        assert!(!observed.add_people(group(), start + Duration::from_secs(29)));
        for half_minute in 1..500 {
            observed.add_people(group(), start + PEOPLE_PAUSE * half_minute);
        }
        assert_eq!(observed.people().len(), MAX_PEOPLE);
        // Empty frames do not delay the next people.
        let end = start + Duration::from_hours(9);
        assert!(!observed.add_people(std::iter::empty(), end) && observed.add_people(group(), end));
    }
}
