//! The execution of one batch: rendering, inference for views with motion, and dispatch of the
//! detections.

use std::time::Instant;

use rayon::{ThreadPool, prelude::*};

use super::{BatchCost, Claim, PassTask};
use crate::inference::{InferenceError, ViewDetection};
use lookdown_imaging::{NetworkInput, ViewBatch, ViewSignature};

/// The result of a batch.
pub(super) struct Run {
    /// The views in the order of the claims.
    views: Vec<SeenView>,
    non_finite: usize,
    /// True when the network ran, that is, when at least one view had motion.
    ran: bool,
    began: Instant,
    rendered: Instant,
    ended: Instant,
}

struct SeenView {
    found: Vec<ViewDetection>,
    is_still: bool,
}

/// The slot of one view in a batch, before inference.
struct BatchSlot<'a> {
    task: &'a PassTask,
    view: usize,
    /// The signature for motion detection, when the camera uses the motion cache.
    signature: Option<ViewSignature>,
    /// The cached detections, when nothing has moved since.
    still: Option<Vec<ViewDetection>>,
}

impl BatchSlot<'_> {
    fn render(&mut self, input: &NetworkInput, planes: &mut [f32]) {
        let (task, view) = (self.task, self.view);
        task.rig.render_view(view, &task.frame, input, planes);
        if let Some(seen_before) = &task.seen_before {
            let signature = ViewSignature::new(planes, input);
            self.still = seen_before.lookup(view, &signature);
            self.signature = Some(signature);
        }
    }

    /// Returns the cached detections of a still view, otherwise those of `now`, which are cached.
    fn seen(self, mut now: impl FnMut() -> Vec<ViewDetection>) -> SeenView {
        if let Some(found) = self.still {
            return SeenView {
                found,
                is_still: true,
            };
        }
        let found = now();
        if let (Some(seen_before), Some(signature)) = (&self.task.seen_before, self.signature) {
            seen_before.store(self.view, signature, found.clone());
        }
        SeenView {
            found,
            is_still: false,
        }
    }
}

/// Renders the views and runs the network on those with motion.
pub(super) fn execute(
    claims: &[Claim],
    session: usize,
    remappers: &ThreadPool,
    batch: &mut ViewBatch,
) -> Result<Run, InferenceError> {
    let began = Instant::now();
    let model = &claims[0].task.model;
    let input = &model.input;
    let mut slots: Vec<_> = claims.iter().flat_map(Claim::slots).collect();
    let planes = batch.prepare(slots.len(), input);
    let mut pairs: Vec<_> = slots.iter_mut().zip(planes).collect();
    let render = |(slot, planes): (&mut BatchSlot, &mut [f32])| slot.render(input, planes);
    match pairs.pop() {
        Some(only) if pairs.is_empty() => render(only),
        last => remappers.install(|| pairs.into_par_iter().chain(last).for_each(render)),
    }
    if slots.iter().any(|slot| slot.still.is_some()) {
        let moved: Vec<_> = slots.iter().map(|slot| slot.still.is_none()).collect();
        batch.retain(&moved);
    }
    let rendered = Instant::now();
    let ran = batch.views() > 0;
    let (per_view, non_finite) = if ran {
        let output = model.detect(session, batch)?;
        (output.per_view, output.non_finite)
    } else {
        (Vec::new(), 0)
    };
    let ended = Instant::now();
    let mut found = per_view.into_iter();
    let seen = slots.into_iter();
    let views = seen.map(|slot| slot.seen(|| found.next().unwrap_or_default()));
    Ok(Run {
        views: views.collect(),
        non_finite,
        ran,
        began,
        rendered,
        ended,
    })
}

impl Claim {
    fn slots(&self) -> impl Iterator<Item = BatchSlot<'_>> {
        self.views.clone().map(|view| BatchSlot {
            task: &self.task,
            view,
            signature: None,
            still: None,
        })
    }
}

impl Run {
    /// Dispatches the detections and a share of the time to each frame. The counts of runs and
    /// non-finite candidates cannot be divided and go to the frame of the first claim.
    pub(super) fn dispatch(self, claims: &[Claim]) {
        let total = self.views.len();
        let mut views = self.views.into_iter();
        let mut undivided = (usize::from(self.ran), self.non_finite);
        for claim in claims {
            let seen: Vec<_> = views.by_ref().take(claim.views.len()).collect();
            let share = seen.len() as f64 / total as f64;
            let (runs, non_finite) = std::mem::take(&mut undivided);
            let cost = BatchCost {
                began: self.began,
                ended: self.ended,
                remap: (self.rendered - self.began).mul_f64(share),
                inference: (self.ended - self.rendered).mul_f64(share),
                runs,
                still_views: seen.iter().filter(|view| view.is_still).count(),
                non_finite,
            };
            let found = seen.into_iter().map(|view| view.found);
            claim.task.finish(claim.views.clone(), found, cost);
        }
    }
}
