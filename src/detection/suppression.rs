//! The NMS family: pick the best box, lower the scores of those it overlaps, repeat.
//!
//! Hard NMS and the two Soft-NMS variants (Bodla et al., "Soft-NMS – Improving Object Detection
//! With One Line of Code", ICCV 2017) differ only in the factor by which a picked box lowers a
//! score: see [`hard`], [`linear`] and [`gaussian`]. All follow Seidel et al. (2019) in comparing
//! `IoU >= N_t`.

use std::{
    cmp::Ordering,
    collections::{BinaryHeap, binary_heap::PeekMut},
};

use super::{Candidate, MergedDetection, RefinementParameters, overlap_grid::OverlapGrid};

/// Hard NMS: 0 where IoU ≥ `N_t`, else 1. At `iou_threshold` 0 even a box far away is suppressed
/// (0 ≥ 0): one box is left. At 1 only boxes that coincide are.
pub(super) fn hard(iou_threshold: f64) -> impl Fn(f64) -> f64 {
    move |iou| if iou >= iou_threshold { 0.0 } else { 1.0 }
}

/// Linear Soft-NMS: 1 − IoU where IoU ≥ `N_t`, else 1. At `iou_threshold` 0 every overlap counts;
/// at 1 only boxes that coincide are lowered, to 0.
pub(super) fn linear(iou_threshold: f64) -> impl Fn(f64) -> f64 {
    move |iou| if iou >= iou_threshold { 1.0 - iou } else { 1.0 }
}

/// Gaussian Soft-NMS: exp(−IoU² / σ).
pub(super) fn gaussian(sigma: f64) -> impl Fn(f64) -> f64 {
    move |iou| (-iou * iou / sigma).exp()
}

/// Picks boxes by descending score; `factor` says, from the IoU with a picked box, what is left
/// of a score, and leaves it as it is below `least_iou`. Of equal scores the lower index goes first.
///
/// Scores only ever fall, hence three shortcuts that change no result:
/// * A candidate below the threshold can never be picked, nor then lower another: it is left out
///   from the start.
/// * A score computed against the first few picked boxes bounds the true one from above, so
///   candidates wait in a heap by that bound, and only the one on top is brought up to date.
/// * Picked scores descend, so the loop ends at `max_detections`.
pub(super) fn suppress(
    candidates: &[Candidate],
    parameters: &RefinementParameters,
    least_iou: f64,
    factor: impl Fn(f64) -> f64,
) -> Vec<MergedDetection> {
    let mut waiting: BinaryHeap<Waiting> = candidates
        .iter()
        .enumerate()
        .filter(|(_, candidate)| candidate.is_usable() && parameters.keeps(candidate.score))
        .map(|(index, candidate)| Waiting {
            score: candidate.score,
            index,
            seen: 0,
        })
        .collect();
    let boxes = waiting
        .iter()
        .map(|waiting| &candidates[waiting.index].bbox);
    let mut grid = OverlapGrid::covering(boxes, least_iou);
    let mut picked: Vec<MergedDetection> = Vec::new();
    let mut overlaps = Vec::new();
    // Boxes apart are never compared. It is only hard NMS at N_t = 0 that would suppress them.
    let at_most = if factor(0.0) <= 0.0 {
        parameters.max_detections.min(1)
    } else {
        parameters.max_detections
    };

    while picked.len() < at_most
        && let Some(mut top) = waiting.peek_mut()
    {
        let bbox = candidates[top.index].bbox;
        if top.seen < picked.len() {
            grid.overlaps(&bbox, top.seen, &mut overlaps);
            for overlap in &overlaps {
                top.score *= factor(overlap.iou);
            }
            top.seen = picked.len();
            if !parameters.keeps(top.score) {
                PeekMut::pop(top);
            }
            // Otherwise it sinks to where it belongs now.
            continue;
        }
        let Waiting { score, index, .. } = PeekMut::pop(top);
        grid.insert(&bbox);
        picked.push(MergedDetection {
            bbox,
            score,
            members: vec![index],
        });
    }
    picked
}

/// A candidate not yet picked. The greatest is the next in line.
struct Waiting {
    /// Its score after the first `seen` picked boxes: an upper bound.
    score: f64,
    index: usize,
    seen: usize,
}

impl Ord for Waiting {
    fn cmp(&self, other: &Self) -> Ordering {
        self.score
            .total_cmp(&other.score)
            .then(other.index.cmp(&self.index))
    }
}

impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Waiting {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Waiting {}

#[cfg(test)]
mod tests;
