//! Weighted box fusion: averages the boxes of a person instead of selecting one.
//!
//! Based on Solovyev et al., "Weighted Boxes Fusion" (Image and Vision Computing 107, 2021), with
//! three changes. Each change increased average precision on real and on rendered frames:
//!
//! * The weight of a coordinate is score³ × the candidate's coordinate weight. This is sharper than
//!   the score alone, and boxes cut off by the border of a view have little influence.
//! * The score of a person is the mean vote of its supporting views. A box votes with its score ×
//!   its IoU with the fused box. The mean is taken over the best vote of each distinct view, for
//!   the best `w` views. `w` is 3 or the number of views that should detect the person, whichever
//!   is less. A missing view counts as 0. The expected number of views is an estimate of each
//!   member at its own box, averaged with the same weights as the coordinates.
//! * A fused box that lies mostly within a better one (or the other way round) is probably a part
//!   of the same person or a group, so its score is lowered ([`penalise_nested`]).

use lookdown_lens::saturating::to_usize;

use super::{
    BBox, Candidate, FramePixels, MergedDetection, RefinementParameters,
    overlap_grid::{Overlap, OverlapGrid},
};

/// Most views that vote on a score. More would outvote a person whom few views show well.
const MAX_SUPPORTING_VIEWS: usize = 3;
/// Share of the smaller box's area at which a box begins to count as nested in another.
const NESTED_FROM: f64 = 0.5;
/// Share of the smaller box's area at which a box counts as fully nested.
const NESTED_FULLY: f64 = 0.9;
/// Share of its score that a fully nested box loses to a better box with an unreduced score.
const NESTED_PENALTY: f64 = 0.5;

/// Fuses all usable candidates. Candidates below the score threshold also vote. The threshold and
/// `max_detections` apply to the fused scores.
///
/// Candidates are processed by descending score, and by ascending index for equal scores. Each
/// candidate joins the cluster whose current fused box it overlaps most, if that IoU reaches the
/// threshold. For equal IoUs the older cluster is taken. Any other candidate founds a new cluster.
/// Boxes that do not overlap are never fused, also at threshold 0.
pub(super) fn fuse(
    candidates: &[Candidate],
    parameters: &RefinementParameters,
) -> Vec<MergedDetection> {
    let mut order: Vec<usize> = (0..candidates.len())
        .filter(|index| candidates[*index].is_usable())
        .collect();
    order.sort_unstable_by(|a, b| {
        let by_score = candidates[*b].score.total_cmp(&candidates[*a].score);
        by_score.then(a.cmp(b))
    });

    let boxes = order.iter().map(|index| &candidates[*index].bbox);
    let mut grid = OverlapGrid::covering(boxes, parameters.iou_threshold);
    let mut clusters: Vec<Cluster> = Vec::new();
    let mut overlaps = Vec::new();
    for index in order {
        let candidate = &candidates[index];
        grid.overlaps(&candidate.bbox, 0, &mut overlaps);
        if let Some(number) = best_of(&overlaps) {
            clusters[number].absorb(index, candidate);
            grid.move_to(number, &clusters[number].bbox);
        } else {
            grid.insert(&candidate.bbox);
            clusters.push(Cluster::founded_by(index, candidate));
        }
    }

    // No member of a cluster has a higher score than its founder.
    let mut fused: Vec<MergedDetection> = clusters
        .into_iter()
        .take_while(|cluster| cluster.best_score >= parameters.score_threshold)
        .map(|cluster| cluster.into_detection(candidates))
        .filter(|detection| detection.score >= parameters.score_threshold)
        .collect();
    sort_by_score(&mut fused);
    penalise_nested(&mut fused);
    fused.retain(|detection| parameters.keeps(detection.score));
    sort_by_score(&mut fused);
    fused.truncate(parameters.max_detections);
    fused
}

fn sort_by_score(detections: &mut [MergedDetection]) {
    detections.sort_by(|a, b| b.score.total_cmp(&a.score));
}

/// Lowers the scores of boxes that share most of the smaller box's area with a better one. The
/// reduction is at most [`NESTED_PENALTY`], in proportion to the remaining share of the better
/// box's score.
fn penalise_nested(descending: &mut [MergedDetection]) {
    let mut grid = OverlapGrid::covering(descending.iter().map(|detection| &detection.bbox), 0.0);
    for detection in descending.iter() {
        grid.insert(&detection.bbox);
    }
    let original: Vec<f64> = descending.iter().map(|detection| detection.score).collect();
    let mut overlaps = Vec::new();
    for better in 0..descending.len() {
        let bbox = descending[better].bbox;
        let standing = descending[better].score / original[better];
        grid.overlaps(&bbox, better + 1, &mut overlaps);
        for &Overlap { number: worse, .. } in &overlaps {
            let other = descending[worse].bbox;
            let smaller_area = bbox.area().min(other.area());
            if smaller_area > 0.0 {
                let shared = bbox.intersection_area(&other) / smaller_area;
                let nested =
                    ((shared - NESTED_FROM) / (NESTED_FULLY - NESTED_FROM)).clamp(0.0, 1.0);
                descending[worse].score *= 1.0 - NESTED_PENALTY * nested * standing;
            }
        }
    }
}

/// Returns the number of the box with the largest overlap, the lowest number for equal overlaps.
fn best_of(overlaps: &[Overlap]) -> Option<usize> {
    let first = overlaps.first()?;
    let best = overlaps.iter().fold(first, |best, overlap| {
        if overlap.iou > best.iou {
            overlap
        } else {
            best
        }
    });
    Some(best.number)
}

/// The agreement of two boxes, 0 to 1. Equal boxes agree fully, also without an area.
fn agreement(a: &BBox<FramePixels>, b: &BBox<FramePixels>) -> f64 {
    if a == b { 1.0 } else { a.iou(b) }
}

/// Candidates assigned to one person, with running weighted means.
struct Cluster {
    bbox: BBox<FramePixels>,
    expected_views: f64,
    weight: f64,
    best_score: f64,
    members: Vec<usize>,
}

impl Cluster {
    fn founded_by(index: usize, candidate: &Candidate) -> Self {
        Self {
            bbox: candidate.bbox,
            expected_views: candidate.expected_views,
            weight: candidate.coordinate_weight,
            best_score: candidate.score,
            members: vec![index],
        }
    }

    fn absorb(&mut self, index: usize, candidate: &Candidate) {
        // Relative to the founder, which has the best score, so that tiny scores do not underflow.
        let weight = (candidate.score / self.best_score).powi(3) * candidate.coordinate_weight;
        self.weight += weight;
        let share = weight / self.weight;
        self.bbox = self.bbox.moved_towards(&candidate.bbox, share);
        self.expected_views =
            self.expected_views * (1.0 - share) + candidate.expected_views * share;
        self.members.push(index);
    }

    fn into_detection(self, candidates: &[Candidate]) -> MergedDetection {
        MergedDetection {
            bbox: self.bbox,
            score: self.mean_vote(candidates),
            members: self.members,
        }
    }

    fn mean_vote(&self, candidates: &[Candidate]) -> f64 {
        let mut votes: Vec<(f64, usize)> = self
            .members
            .iter()
            .map(|&index| {
                let Candidate {
                    bbox, view, score, ..
                } = &candidates[index];
                (score * agreement(bbox, &self.bbox), *view)
            })
            .collect();
        votes.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        let mut seen_views: Vec<usize> = Vec::with_capacity(MAX_SUPPORTING_VIEWS);
        let mut sum = 0.0;
        let required = self.required_votes();
        // The order is descending, so the first vote of a view is its best.
        for (vote, view) in votes {
            if seen_views.len() == required {
                break;
            }
            if !seen_views.contains(&view) {
                seen_views.push(view);
                sum += vote;
            }
        }
        sum / required as f64
    }

    fn required_votes(&self) -> usize {
        to_usize(self.expected_views.round()).clamp(1, MAX_SUPPORTING_VIEWS)
    }
}

#[cfg(test)]
mod tests;
