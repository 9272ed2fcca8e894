//! Weighted box fusion: average the boxes of a person instead of picking one.
//!
//! After Solovyev et al., "Weighted Boxes Fusion" (Image and Vision Computing 107, 2021), with
//! three changes, each of which gained average precision on real and on rendered frames:
//!
//! * A coordinate's weight is score³ × the candidate's own weight: sharper than the score alone,
//!   and boxes cut off by a view's border hardly pull.
//! * The score of a person is what its witnesses say on average. A word is a box's score × its IoU
//!   with the fused box; the score is the mean of the best word of each distinct view, over the best `w` views, where `w` is 3 or the number of views that should have
//!   seen the person, whichever is less. A view that is missing counts as 0. That number is an
//!   estimate of each member at its own box, averaged with the same weights as the coordinates.
//! * A fused box that lies mostly within a better one (or the other way round) is probably a part
//!   of the same person, such as the legs or a group ([`doubt_nested`]).

use super::{
    BBox, Candidate, FramePixels, MergedDetection, RefinementParameters,
    overlap_grid::{Overlap, OverlapGrid},
};

/// Views whose word makes a score: more would outvote a person whom few see well.
const WITNESSES: usize = 3;
/// A box is nested in another from this share of the smaller one's area on …
const NESTED_FROM: f64 = 0.5;
/// … and fully from this share on.
const NESTED_FULLY: f64 = 0.9;
/// How much of its score a fully nested box loses to an undoubted better one.
const NESTED_DOUBT: f64 = 0.5;

/// Fuses all usable candidates, also those below the score threshold: they are witnesses, too.
/// The threshold and `max_detections` apply to the fused scores.
///
/// By descending score (of equal ones the lower index first), each candidate joins the cluster
/// whose fused box, as it is by then, it overlaps most (of equal ones the older), if that IoU is
/// at least the threshold; otherwise it founds a cluster. Boxes apart are never fused, also at
/// threshold 0.
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

    // Nothing that joins a cluster is worth more than its founder.
    let mut fused: Vec<MergedDetection> = clusters
        .into_iter()
        .take_while(|cluster| cluster.best_score >= parameters.score_threshold)
        .map(|cluster| cluster.into_detection(candidates))
        .filter(|detection| detection.score >= parameters.score_threshold)
        .collect();
    sort_by_score(&mut fused);
    doubt_nested(&mut fused);
    fused.retain(|detection| parameters.keeps(detection.score));
    sort_by_score(&mut fused);
    fused.truncate(parameters.max_detections);
    fused
}

fn sort_by_score(detections: &mut [MergedDetection]) {
    detections.sort_by(|a, b| b.score.total_cmp(&a.score));
}

/// Lowers the scores of boxes that share most of the smaller box's area with a better one: by up
/// to [`NESTED_DOUBT`], in proportion to how much of the better box's own score is left.
fn doubt_nested(descending: &mut [MergedDetection]) {
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
                descending[worse].score *= 1.0 - NESTED_DOUBT * nested * standing;
            }
        }
    }
}

/// The number of the box that is overlapped most; of equal ones the lowest.
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

/// How much two boxes agree, 0 to 1: equal ones fully, also if they have no area.
fn agreement(a: &BBox<FramePixels>, b: &BBox<FramePixels>) -> f64 {
    if a == b { 1.0 } else { a.iou(b) }
}

/// Candidates taken for one person, with running weighted means.
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
        // Relative to the founder, whose score is the best: tiny scores do not underflow.
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
            score: self.mean_witness_score(candidates),
            members: self.members,
        }
    }

    fn mean_witness_score(&self, candidates: &[Candidate]) -> f64 {
        let mut words: Vec<(f64, usize)> = self
            .members
            .iter()
            .map(|&index| {
                let Candidate {
                    bbox, view, score, ..
                } = &candidates[index];
                (score * agreement(bbox, &self.bbox), *view)
            })
            .collect();
        words.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        let mut heard: Vec<usize> = Vec::with_capacity(WITNESSES);
        let mut sum = 0.0;
        let wanted = self.witnesses_wanted();
        // In descending order, a view's first word is its best.
        for (word, view) in words {
            if heard.len() == wanted {
                break;
            }
            if !heard.contains(&view) {
                heard.push(view);
                sum += word;
            }
        }
        #[expect(clippy::cast_precision_loss, reason = "at most three witnesses")]
        let mean = sum / wanted as f64;
        mean
    }

    fn witnesses_wanted(&self) -> usize {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at least 1, and clamped"
        )]
        let expected = self.expected_views.round().min(1e6) as usize;
        expected.clamp(1, WITNESSES)
    }
}

#[cfg(test)]
mod tests;
