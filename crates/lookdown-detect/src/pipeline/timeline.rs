//! The stages of a frame with their times. Workers record them, and the request handler reads them,
//! also after a failure.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use parking_lot::Mutex;
use strum::IntoStaticStr;

use super::StageTimings;

/// A stage in the processing of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum Stage {
    /// Decoding of the image.
    Decode,
    /// Camera setup: calibration, lens circle, and remap tables when they are not cached.
    Calibrate,
    /// Waiting for a worker and for the network.
    Queue,
    /// Remapping of the frame to network inputs.
    Remap,
    /// Inference.
    Inference,
    /// Back-projection and merge.
    Refine,
}

impl Stage {
    /// Returns the name, as in reports.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// A time span in one stage. A frame with several passes is in some stages more than once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StageSpan {
    /// The stage.
    pub stage: Stage,
    /// The start of the span.
    pub began: Instant,
    /// The end of the span.
    pub ended: Instant,
}

/// The sequence of stages of one frame. Clones share the same timeline.
#[derive(Debug, Clone, Default)]
pub struct Timeline(Arc<Mutex<Stages>>);

#[derive(Debug, Default)]
struct Stages {
    over: Vec<StageSpan>,
    now: Option<(Stage, Instant)>,
    /// The last sign of progress: a change of the stage, or a batch of views.
    progressed: Option<Instant>,
}

impl Stages {
    /// Returns the later of `at` and the last recorded time: clock readings of different threads
    /// may be out of order.
    fn not_before_the_last(&self, at: Instant) -> Instant {
        let began = self.now.map(|(_, began)| began);
        let last = began.or(self.over.last().map(|span| span.ended));
        last.map_or(at, |last| last.max(at))
    }

    fn progress(&mut self, at: Instant) {
        self.progressed = self.progressed.max(Some(at));
    }

    fn leave(&mut self, at: Instant) {
        if let Some((stage, began)) = self.now.take() {
            let ended = at.max(began);
            self.progress(ended);
            self.over.push(StageSpan {
                stage,
                began,
                ended,
            });
        }
    }
}

impl Timeline {
    /// Returns the stages so far. The current stage ends at `until`.
    pub fn spans(&self, until: Instant) -> Vec<StageSpan> {
        let stages = self.0.lock();
        let now = stages.now.map(|(stage, began)| StageSpan {
            stage,
            began,
            ended: until.max(began),
        });
        stages.over.iter().copied().chain(now).collect()
    }

    /// Returns the total time in each completed stage.
    pub(super) fn timings(&self) -> StageTimings {
        let mut timings = StageTimings::default();
        for span in &self.0.lock().over {
            *timings.stage_mut(span.stage) += span.ended - span.began;
        }
        timings
    }

    /// Records that the frame leaves its current stage and enters `stage`.
    pub(super) fn enter(&self, stage: Stage, at: Instant) {
        let mut stages = self.0.lock();
        stages.progress(at);
        if stages.now.is_none_or(|(now, _)| now != stage) {
            let at = stages.not_before_the_last(at);
            stages.leave(at);
            stages.now = Some((stage, at));
        }
    }

    /// Records that the frame leaves its current stage.
    pub(super) fn leave(&self, at: Instant) {
        self.0.lock().leave(at);
    }

    /// Records that the work of the current stage progresses.
    pub(super) fn progress(&self, at: Instant) {
        self.0.lock().progress(at);
    }

    /// Returns the current stage and the time of the last progress.
    pub(super) fn standing(&self) -> (Option<Stage>, Option<Instant>) {
        let stages = self.0.lock();
        (stages.now.map(|(stage, _)| stage), stages.progressed)
    }
}

impl StageTimings {
    fn stage_mut(&mut self, stage: Stage) -> &mut Duration {
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
    fn stages_do_not_overlap_and_repeated_stages_add_up() {
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
        let millis_of_spans: Vec<_> = spans
            .iter()
            .map(|span| {
                let millis = [span.began, span.ended].map(|at| (at - start).as_millis());
                (span.stage.name(), millis)
            })
            .collect();
        assert_eq!(
            millis_of_spans,
            [("queue", [0, 5]), ("decode", [5, 7]), ("queue", [10, 14])]
        );
        timeline.leave(after(11));
        let timings = timeline.timings();
        assert_eq!(timings.queue, Duration::from_millis(6));
        assert_eq!(timings.worked(), Duration::from_millis(2));
    }

    #[test]
    fn stages_stay_disjoint_with_out_of_order_clock_readings() {
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
