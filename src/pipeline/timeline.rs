//! When a frame was in which stage: entered by whoever works on it, read by whoever waits for it,
//! also when it comes to nothing.

use std::{
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use strum::IntoStaticStr;

use super::StageTimings;

/// A stage of a frame's way to its report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum Stage {
    /// Bytes to pixels.
    Decode,
    /// Finding the camera: calibration, lens circle, tables when they are new.
    Calibrate,
    /// Waiting for a worker and for the network.
    Queue,
    /// Frame to network input.
    Remap,
    /// The network.
    Inference,
    /// Back-projection and merge.
    Refine,
}

impl Stage {
    /// Returns the name, as in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// A stretch of time in one stage. A frame that is looked at twice is in some stages twice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StageSpan {
    /// The stage.
    pub stage: Stage,
    /// When it began.
    pub began: Instant,
    /// When it ended.
    pub ended: Instant,
}

/// The stages of one frame, one after another. Clones share it.
#[derive(Debug, Clone, Default)]
pub struct Timeline(Arc<Mutex<Stages>>);

#[derive(Debug, Default)]
struct Stages {
    over: Vec<StageSpan>,
    now: Option<(Stage, Instant)>,
}

impl Stages {
    /// This moment, or the latest that is known, if that is later: several threads look at the clock.
    fn not_before_the_last(&self, at: Instant) -> Instant {
        let began = self.now.map(|(_, began)| began);
        let last = began.or(self.over.last().map(|span| span.ended));
        last.map_or(at, |last| last.max(at))
    }

    fn leave(&mut self, at: Instant) {
        if let Some((stage, began)) = self.now.take() {
            let ended = at.max(began);
            self.over.push(StageSpan {
                stage,
                began,
                ended,
            });
        }
    }
}

impl Timeline {
    /// The stages so far; the one the frame is in ends at `until`.
    #[must_use]
    pub fn spans(&self, until: Instant) -> Vec<StageSpan> {
        let stages = self.lock();
        let now = stages.now.map(|(stage, began)| StageSpan {
            stage,
            began,
            ended: until.max(began),
        });
        stages.over.iter().copied().chain(now).collect()
    }

    /// How long the frame was in each stage that is over.
    pub(super) fn timings(&self) -> StageTimings {
        let mut timings = StageTimings::default();
        for span in &self.lock().over {
            *timings.of_mut(span.stage) += span.ended - span.began;
        }
        timings
    }

    /// The frame enters a stage, and leaves the one it is in.
    pub(super) fn enter(&self, stage: Stage, at: Instant) {
        let mut stages = self.lock();
        if stages.now.is_none_or(|(now, _)| now != stage) {
            let at = stages.not_before_the_last(at);
            stages.leave(at);
            stages.now = Some((stage, at));
        }
    }

    /// The frame leaves the stage it is in.
    pub(super) fn leave(&self, at: Instant) {
        self.lock().leave(at);
    }

    fn lock(&self) -> MutexGuard<'_, Stages> {
        // No change can panic half-way.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl StageTimings {
    fn of_mut(&mut self, stage: Stage) -> &mut Duration {
        match stage {
            Stage::Decode => &mut self.decode,
            Stage::Calibrate => &mut self.calibrate,
            Stage::Queue => &mut self.queue,
            Stage::Remap => &mut self.remap,
            Stage::Inference => &mut self.inference,
            Stage::Refine => &mut self.refine,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_in_one_stage_at_a_time_and_stages_that_return_add_up() {
        let timeline = Timeline::default();
        let start = Instant::now();
        let after = |millis| start + Duration::from_millis(millis);
        timeline.enter(Stage::Queue, start);
        timeline.enter(Stage::Queue, after(2));
        timeline.enter(Stage::Decode, after(5));
        timeline.leave(after(7));
        timeline.leave(after(8));
        timeline.enter(Stage::Queue, after(10));
        let spans = timeline.clone().spans(after(14));
        let told: Vec<_> = spans
            .iter()
            .map(|span| {
                let millis = [span.began, span.ended].map(|at| (at - start).as_millis());
                (span.stage.name(), millis)
            })
            .collect();
        assert_eq!(
            told,
            [("queue", [0, 5]), ("decode", [5, 7]), ("queue", [10, 14])]
        );
        timeline.leave(after(11));
        let timings = timeline.timings();
        assert_eq!(timings.queue, Duration::from_millis(6));
        assert_eq!(timings.worked(), Duration::from_millis(2));
    }

    #[test]
    fn stages_stay_apart_when_threads_disagree_about_the_time() {
        let timeline = Timeline::default();
        let (now, later) = (Instant::now(), Instant::now() + Duration::from_secs(1));
        timeline.enter(Stage::Queue, later);
        timeline.enter(Stage::Remap, now);
        timeline.leave(later);
        timeline.enter(Stage::Inference, now);
        timeline.leave(now);
        for span in timeline.spans(now) {
            assert_eq!((span.began, span.ended), (later, later), "{span:?}");
        }
        assert_eq!(timeline.timings(), StageTimings::default());
    }
}
