//! The frames and people of one camera.

use std::{
    collections::VecDeque,
    time::{Duration, Instant},
};

use lookdown_calibration::{CalibrationId, native::NativeImage};
use lookdown_imaging::room_fit::RoomFrame;
use lookdown_lens::{
    geometry::OrientedBox,
    self_calibration::{CameraHeight, FitRefusal, HeightRefusal, RoomFit},
};

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
    subject: Subject,
    size: (u32, u32),
    seen_at: Option<Instant>,
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

    pub(super) fn seen_at(&self) -> Option<Instant> {
        self.seen_at
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

    pub(super) fn subject(&self) -> &Subject {
        &self.subject
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
