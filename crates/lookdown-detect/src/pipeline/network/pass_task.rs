//! One pass over a frame while its views are queued for inference or being processed.

use std::{ops::Range, sync::Arc, time::Instant};

use parking_lot::{Condvar, Mutex};

use super::BatchCost;
use crate::{
    inference::{Model, ViewDetection},
    pipeline::{PipelineError, Ticket, camera_rig::CameraRig, motion_cache::CameraViews},
};
use lookdown_imaging::Frame;

/// One pass over a frame: the views of a rig and the model that processes them.
pub(in crate::pipeline) struct PassTask {
    pub(in crate::pipeline) rig: Arc<CameraRig>,
    pub(in crate::pipeline) model: Arc<Model>,
    pub(super) frame: Arc<Frame>,
    pub(super) ticket: Ticket,
    /// The motion cache of the camera, when cached detections may replace inference on still views.
    pub(super) seen_before: Option<Arc<CameraViews>>,
    /// The tracing span to which the log lines of the work belong.
    pub(super) request: tracing::Span,
    pub(super) queued: Instant,
    // The queue counts the views, so no update can panic half-way.
    progress: Mutex<Progress>,
    over: Condvar,
}

/// The result of a pass.
#[derive(Debug)]
pub(in crate::pipeline) struct PassOutput {
    /// The detections in each view.
    pub(in crate::pipeline) per_view: Vec<Vec<ViewDetection>>,
    /// The cost of the pass.
    pub(in crate::pipeline) cost: BatchCost,
}

struct Progress {
    per_view: Vec<Vec<ViewDetection>>,
    missing: usize,
    cost: Option<BatchCost>,
    failed: bool,
    failure: Option<PipelineError>,
}

impl PassTask {
    pub(super) fn new(
        rig: Arc<CameraRig>,
        model: Arc<Model>,
        frame: Arc<Frame>,
        ticket: Ticket,
        seen_before: Option<Arc<CameraViews>>,
    ) -> Self {
        let views = rig.view_count();
        Self {
            rig,
            model,
            frame,
            ticket,
            seen_before,
            request: tracing::Span::current(),
            queued: Instant::now(),
            progress: Mutex::new(Progress {
                per_view: vec![Vec::new(); views],
                missing: views,
                cost: None,
                failed: false,
                failure: None,
            }),
            over: Condvar::new(),
        }
    }

    /// Waits until every view is processed or the pass fails. Blocks.
    pub(in crate::pipeline) fn wait(&self) -> Result<PassOutput, PipelineError> {
        let mut progress = self.progress.lock();
        self.over
            .wait_while(&mut progress, |progress| !progress.is_over());
        if let Some(failure) = progress.failure.take() {
            return Err(failure);
        }
        Ok(PassOutput {
            per_view: std::mem::take(&mut progress.per_view),
            cost: progress
                .cost
                .unwrap_or_else(|| BatchCost::none(self.queued)),
        })
    }

    /// Returns true when the remaining views are not needed: the pass failed, or its client has
    /// disconnected.
    pub(super) fn is_pointless(&self) -> bool {
        self.ticket.withdrawn.is_cancelled() || self.progress.lock().failed
    }

    /// Ends the pass with an error. Detections in views still being processed are discarded.
    pub(super) fn fail(&self, error: PipelineError) {
        let mut progress = self.progress.lock();
        if !progress.failed {
            progress.failed = true;
            progress.failure = Some(error);
        }
        drop(progress);
        self.over.notify_all();
    }

    /// Accepts the detections in some views.
    pub(super) fn finish(
        &self,
        views: Range<usize>,
        found: impl Iterator<Item = Vec<ViewDetection>>,
        cost: BatchCost,
    ) {
        self.ticket.timeline.progress(cost.ended);
        let mut progress = self.progress.lock();
        progress.missing -= views.len();
        for (slot, found) in progress.per_view[views].iter_mut().zip(found) {
            *slot = found;
        }
        progress.cost = Some(progress.cost.map_or(cost, |before| before.and(cost)));
        let over = progress.is_over();
        drop(progress);
        if over {
            self.over.notify_all();
        }
    }
}

impl Progress {
    fn is_over(&self) -> bool {
        self.missing == 0 || self.failed
    }
}
