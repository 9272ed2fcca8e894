//! A fake detector that returns one or many persons in the middle of every view, when its gate
//! opens.

use std::{
    sync::{Arc, Condvar, Mutex},
    time::Duration,
};

use lookdown_detect::{
    detection::BBox,
    inference::{Detector, HeadOutput, InferenceError, ViewDetection},
};
use lookdown_imaging::{NetworkInput, ViewBatch};

/// A test that waits longer than this has failed.
const TIMEOUT: Duration = Duration::from_secs(20);

/// Returns a person in every view.
pub(crate) struct EagerDetector {
    pub(crate) name: String,
    pub(crate) input: NetworkInput,
    pub(crate) gate: Arc<Gate>,
}

/// Blocks the detector and counts its runs.
#[derive(Default)]
pub(crate) struct Gate {
    state: Mutex<GateState>,
    changed: Condvar,
}

#[derive(Default)]
struct GateState {
    closed: bool,
    panics: bool,
    fails: Option<InferenceError>,
    runs: usize,
    /// Number of persons in every view besides the one in the middle.
    crowd: u32,
}

impl Gate {
    pub(crate) fn close(&self) {
        self.change(|state| state.closed = true);
    }

    pub(crate) fn open(&self) {
        self.change(|state| state.closed = false);
    }

    /// Makes the next run panic.
    pub(crate) fn panic_once(&self) {
        self.change(|state| state.panics = true);
    }

    /// Makes the next run fail.
    pub(crate) fn fail_once(&self, error: InferenceError) {
        self.change(|state| state.fails = Some(error));
    }

    /// Makes the next runs return this number of additional persons in every view.
    pub(crate) fn crowd(&self, persons: u32) {
        self.change(|state| state.crowd = persons);
    }

    /// Resets the count of runs.
    pub(crate) fn forget_runs(&self) {
        self.change(|state| state.runs = 0);
    }

    /// Returns the number of runs that have begun.
    pub(crate) fn runs(&self) -> usize {
        self.state.lock().unwrap().runs
    }

    /// Waits until `runs` runs have begun.
    pub(crate) async fn has_begun(self: &Arc<Self>, runs: usize) {
        let gate = Arc::clone(self);
        let waiting = tokio::task::spawn_blocking(move || gate.wait(|state| state.runs >= runs));
        waiting.await.unwrap();
    }

    fn pass(&self) {
        self.change(|state| state.runs += 1);
        let panics = self.wait(|state| !state.closed);
        assert!(!panics, "the secret cause");
    }

    fn change(&self, change: impl FnOnce(&mut GateState)) {
        change(&mut self.state.lock().unwrap());
        self.changed.notify_all();
    }

    /// Waits for a state; returns `true` if the run must panic.
    fn wait(&self, reached: impl Fn(&GateState) -> bool) -> bool {
        let state = self.state.lock().unwrap();
        let (mut state, waited) = self
            .changed
            .wait_timeout_while(state, TIMEOUT, |state| !reached(state))
            .unwrap();
        assert!(!waited.timed_out(), "nothing happened within {TIMEOUT:?}");
        std::mem::take(&mut state.panics)
    }
}

impl Detector for EagerDetector {
    fn name(&self) -> &str {
        &self.name
    }

    fn revision(&self) -> &'static str {
        "1"
    }

    fn input(&self) -> &NetworkInput {
        &self.input
    }

    fn detect(&mut self, batch: &ViewBatch) -> Result<HeadOutput, InferenceError> {
        self.gate.pass();
        if let Some(error) = self.gate.state.lock().unwrap().fails.take() {
            return Err(error);
        }
        let person = ViewDetection {
            bbox: BBox::new([24.0, 16.0, 40.0, 48.0]).unwrap(),
            score: 0.9,
            posture: None,
        };
        let crowd = self.gate.state.lock().unwrap().crowd;
        let view: Vec<_> = std::iter::once(person)
            .chain((0..crowd).map(passer_by))
            .collect();
        Ok(HeadOutput {
            per_view: vec![view; batch.views()],
            non_finite: 0,
        })
    }
}

/// One of many persons: no two have the same box or score.
fn passer_by(number: u32) -> ViewDetection {
    let [x, y, side] = [7, 11, 13].map(|step| f64::from(number * step % 97) / 97.0);
    let (x_min, y_min) = (50.0 * x, 50.0 * y);
    let side = 2.0 + 12.0 * side;
    ViewDetection {
        bbox: BBox::new([x_min, y_min, x_min + side, y_min + side]).unwrap(),
        score: 0.05 + 0.8 * f64::from(number % 89) / 89.0,
        posture: None,
    }
}
