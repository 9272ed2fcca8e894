use std::{
    sync::mpsc::{Receiver, SyncSender, sync_channel},
    time::Duration,
};

use lookdown_calibration::{Areas, CameraGeometry};
use lookdown_lens::geometry::{Lens, Mount, ViewPlan, view_plan::Ring};

use super::*;
use crate::{
    inference::{Detector, HeadOutput, InferenceError},
    parameters::Priority,
};
use lookdown_imaging::NetworkInput;

/// Reports the view count of each run and the brightness of its first view, then waits for release.
struct Gated {
    input: NetworkInput,
    begun: SyncSender<(usize, f32)>,
    gate: Arc<std::sync::Mutex<Receiver<()>>>,
}

impl Detector for Gated {
    fn name(&self) -> &'static str {
        "gated"
    }

    fn revision(&self) -> &'static str {
        "1"
    }

    fn input(&self) -> &NetworkInput {
        &self.input
    }

    fn detect(&mut self, batch: &ViewBatch) -> Result<HeadOutput, InferenceError> {
        let middle = self.input.plane_len() / 2 + self.input.width as usize / 2;
        let brightness = batch.values()[middle];
        self.begun.send((batch.views(), brightness)).unwrap();
        let gate = self.gate.lock().unwrap();
        gate.recv_timeout(Duration::from_mins(1)).unwrap();
        Ok(HeadOutput {
            per_view: vec![Vec::new(); batch.views()],
            non_finite: 0,
        })
    }
}

struct Bench {
    inference: InferenceThreads,
    model: Arc<Model>,
    rig: Arc<CameraRig>,
    begins: Receiver<(usize, f32)>,
    go: SyncSender<()>,
    metrics: Arc<DetectMetrics>,
}

/// `sessions` inference threads with four views per frame.
fn bench(sessions: usize, max_views: usize, max_delay: Duration) -> Bench {
    let input = NetworkInput::plain(8, 8);
    let (begun, begins) = sync_channel(64);
    let (go, gate) = sync_channel(64);
    let gate = Arc::new(std::sync::Mutex::new(gate));
    let mut gated: Vec<Box<dyn Detector>> = Vec::new();
    for _ in 0..sessions {
        gated.push(Box::new(Gated {
            input: input.clone(),
            begun: begun.clone(),
            gate: Arc::clone(&gate),
        }));
    }
    let first = gated.pop().unwrap();
    let lens = Lens::equidistant_circle(31.5, 31.5, 31.0, std::f64::consts::FRAC_PI_2).unwrap();
    let geometry = CameraGeometry {
        lens,
        mount: Mount::default(),
        areas: Areas::default(),
    };
    let plan = ViewPlan::rings(&[Ring {
        elevation: 0.9,
        count: 4,
        field_of_view: 1.6,
    }]);
    let rig = CameraRig::new(geometry, 64, 64, Some(&plan), &input);
    let remappers = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let options = BatchOptions {
        max_views: NonZeroUsize::new(max_views).unwrap(),
        max_delay,
    };
    let sessions = NonZeroUsize::new(sessions).unwrap();
    let (remappers, metrics) = (Arc::new(remappers.unwrap()), Arc::default());
    Bench {
        inference: InferenceThreads::start(sessions, options, &remappers, &metrics).unwrap(),
        model: Arc::new(Model::from_boxed(first, gated)),
        rig: Arc::new(rig),
        begins,
        go,
        metrics,
    }
}

impl Bench {
    /// Queues a frame of uniform brightness.
    fn submit(&self, brightness: u8, ticket: Ticket) -> Arc<PassTask> {
        let frame = Frame::new(64, 64, vec![brightness; 64 * 64 * 3]).unwrap();
        let (rig, model) = (Arc::clone(&self.rig), Arc::clone(&self.model));
        self.inference
            .queue_pass(rig, model, Arc::new(frame), ticket, None)
    }

    /// Returns the next run: its view count and the brightness of its first view.
    fn next_run(&self) -> (usize, f32) {
        self.begins.recv_timeout(Duration::from_mins(1)).unwrap()
    }

    fn let_go(&self, runs: usize) {
        for _ in 0..runs {
            self.go.send(()).unwrap();
        }
    }
}

#[test]
fn histograms_have_the_size_and_the_wait_of_batches() {
    let bench = bench(1, 3, Duration::ZERO);
    bench.let_go(2);
    bench.submit(1, Ticket::default()).wait().unwrap();
    let no_labels: [&str; 0] = [];
    let [size, wait] = [&bench.metrics.batch_size, &bench.metrics.batch_wait]
        .map(|all| all.with_label_values(&no_labels));
    assert_eq!((size.get_sample_count(), size.get_sample_sum()), (2, 4.0));
    assert_eq!(wait.get_sample_count(), 2);
    assert!(wait.get_sample_sum() > 0.0);
}

#[test]
fn a_batch_is_filled_with_views_of_the_next_frame() {
    let bench = bench(1, 6, Duration::ZERO);
    // Occupies the thread while the others queue.
    let before = bench.submit(1, Ticket::default());
    assert_eq!(bench.next_run(), (4, 1.0));
    let (first, second) = (
        bench.submit(10, Ticket::default()),
        bench.submit(20, Ticket::default()),
    );
    bench.let_go(3);
    assert_eq!(bench.next_run(), (6, 10.0));
    assert_eq!(bench.next_run(), (2, 20.0));
    before.wait().unwrap();
    let outputs = [first.wait().unwrap(), second.wait().unwrap()];
    assert!(outputs.iter().all(|output| output.per_view.len() == 4));
    // The shared run counts once.
    assert_eq!(outputs.map(|output| output.cost.runs), [1, 1]);
}

#[test]
fn an_urgent_frame_overtakes_one_that_has_not_begun() {
    let bench = bench(1, 4, Duration::ZERO);
    let before = bench.submit(1, Ticket::default());
    bench.next_run();
    let usual = bench.submit(10, Ticket::default());
    let urgent = bench.submit(
        20,
        Ticket {
            priority: Priority::High,
            ..Ticket::default()
        },
    );
    bench.let_go(3);
    assert_eq!(bench.next_run(), (4, 20.0));
    assert_eq!(bench.next_run(), (4, 10.0));
    for task in [before, usual, urgent] {
        task.wait().unwrap();
    }
}

#[test]
fn views_of_a_withdrawn_frame_never_reach_the_network() {
    let bench = bench(1, 1, Duration::ZERO);
    let ticket = Ticket::default();
    let left = bench.submit(10, ticket.clone());
    assert_eq!(bench.next_run(), (1, 10.0));
    ticket.withdrawn.cancel();
    let next = bench.submit(20, Ticket::default());
    bench.let_go(5);
    assert_eq!(bench.next_run(), (1, 20.0));
    assert!(matches!(left.wait(), Err(PipelineError::Withdrawn)));
    next.wait().unwrap();
}

#[test]
fn sessions_process_views_of_one_frame_in_parallel() {
    let bench = bench(2, 1, Duration::ZERO);
    let task = bench.submit(10, Ticket::default());
    // Both runs begin before either is released.
    bench.next_run();
    bench.next_run();
    bench.let_go(4);
    assert_eq!(task.wait().unwrap().cost.runs, 4);
}

#[test]
fn a_batch_waits_for_more_views_within_the_delay() {
    let bench = bench(1, 8, Duration::from_mins(1));
    let first = bench.submit(10, Ticket::default());
    let second = bench.submit(20, Ticket::default());
    bench.let_go(1);
    assert_eq!(bench.next_run(), (8, 10.0));
    first.wait().unwrap();
    second.wait().unwrap();
}

#[test]
fn a_partial_batch_runs_after_the_maximum_delay() {
    let bench = bench(1, 8, Duration::from_millis(20));
    let task = bench.submit(10, Ticket::default());
    bench.let_go(1);
    assert_eq!(bench.next_run(), (4, 10.0));
    assert!(
        task.wait().unwrap().cost.began.duration_since(task.queued) >= Duration::from_millis(20)
    );
}
