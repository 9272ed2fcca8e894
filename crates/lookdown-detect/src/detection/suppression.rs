//! The NMS family: select the best box, lower the scores of the boxes it overlaps, repeat.
//!
//! Hard NMS and the two Soft-NMS variants differ only in the factor by which a selected box lowers
//! a score: see [`hard`], [`linear`] and [`gaussian`]. Soft-NMS is from Bodla et al., "Soft-NMS –
//! Improving Object Detection With One Line of Code", ICCV 2017. All variants compare `IoU >= N_t`,
//! as in Seidel et al. (2019).

use std::{
    cmp::Ordering,
    collections::{BinaryHeap, binary_heap::PeekMut},
};

use super::{Candidate, MergedDetection, RefinementParameters, overlap_grid::OverlapGrid};

/// Hard NMS: 0 where IoU ≥ `N_t`, else 1. At `iou_threshold` 0 even a distant box is suppressed (0
/// ≥ 0), so one box remains. At 1 only boxes that coincide are suppressed.
pub(super) fn hard(iou_threshold: f64) -> impl Fn(f64) -> f64 {
    move |iou| if iou >= iou_threshold { 0.0 } else { 1.0 }
}

/// Linear Soft-NMS: 1 − IoU where IoU ≥ `N_t`, else 1. At `iou_threshold` 0 every overlap counts.
/// At 1 only boxes that coincide are lowered, to 0.
pub(super) fn linear(iou_threshold: f64) -> impl Fn(f64) -> f64 {
    move |iou| if iou >= iou_threshold { 1.0 - iou } else { 1.0 }
}

/// Gaussian Soft-NMS: exp(−IoU² / σ).
pub(super) fn gaussian(sigma: f64) -> impl Fn(f64) -> f64 {
    move |iou| (-iou * iou / sigma).exp()
}

/// Selects boxes by descending score, and by ascending index for equal scores. `factor` maps the
/// IoU with a selected box to the share of the score that remains. It is 1 below `least_iou`.
///
/// Scores never rise, which allows three shortcuts that do not change the result:
/// * A candidate below the threshold can never be selected, nor lower another candidate, so it is
///   left out from the start.
/// * A score computed against the first few selected boxes is an upper bound of the final one.
///   Candidates wait in a heap ordered by that bound, and only the top one is updated.
/// * Selected scores descend, so the loop ends at `max_detections`.
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
    // Disjoint boxes are never compared. Only hard NMS at N_t = 0 would suppress them.
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
            // Otherwise it moves down the heap to its new position.
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

/// A candidate that is not selected yet. The greatest is the next to be processed.
struct Waiting {
    /// Its score after the first `seen` selected boxes: an upper bound.
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
