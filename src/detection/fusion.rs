//! Weighted box fusion: average the boxes of a person instead of picking one.
//!
//! After Solovyev et al., "Weighted Boxes Fusion" (Image and Vision Computing 107, 2021), with
//! two changes. A coordinate's weight is score² × the candidate's own weight: sharper than the
//! score alone, and boxes cut off by a view's border hardly pull. And agreement is measured
//! between views: the score of a person is
//!
//! ```text
//! best member score · min(1, √(distinct views / expected views))
//! ```
//!
//! * *Distinct views*: a view that reports the same person twice is one witness.
//! * *Expected views* belongs to the place and size of the fused box, and each member's value is
//!   an estimate of it at that member's own box; so it is averaged with the same weights as the
//!   coordinates are.

use super::{
    BBox, Candidate, FramePixels, MergedDetection, RefinementParameters, overlap_grid::OverlapGrid,
};

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
    order.sort_by(|a, b| candidates[*b].score.total_cmp(&candidates[*a].score));

    let mut grid = OverlapGrid::covering(order.iter().map(|index| &candidates[*index].bbox));
    let mut clusters: Vec<Cluster> = Vec::new();
    let mut near = Vec::new();
    for index in order {
        let candidate = &candidates[index];
        grid.near(&candidate.bbox, 0, &mut near);
        let joined = best_cluster(&candidate.bbox, &near, &clusters, parameters.iou_threshold);
        if let Some(number) = joined {
            clusters[number].absorb(index, candidate);
            grid.extend(number, &clusters[number].bbox);
        } else {
            grid.insert(&candidate.bbox);
            clusters.push(Cluster::founded_by(index, candidate));
        }
    }

    let mut fused: Vec<MergedDetection> = clusters
        .into_iter()
        .map(|cluster| cluster.into_detection(candidates))
        .filter(|detection| parameters.keeps(detection.score))
        .collect();
    fused.sort_by(|a, b| b.score.total_cmp(&a.score));
    fused.truncate(parameters.max_detections);
    fused
}

fn best_cluster(
    bbox: &BBox<FramePixels>,
    near: &[usize],
    clusters: &[Cluster],
    iou_threshold: f64,
) -> Option<usize> {
    let mut best = None;
    let mut best_iou = 0.0;
    for &number in near {
        let iou = bbox.iou(&clusters[number].bbox);
        if iou > best_iou && iou >= iou_threshold {
            best = Some(number);
            best_iou = iou;
        }
    }
    best
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
        let relative_score = candidate.score / self.best_score;
        let weight = relative_score * relative_score * candidate.coordinate_weight;
        self.weight += weight;
        let share = weight / self.weight;
        self.bbox = self.bbox.moved_towards(&candidate.bbox, share);
        self.expected_views =
            self.expected_views * (1.0 - share) + candidate.expected_views * share;
        self.members.push(index);
    }

    fn into_detection(self, candidates: &[Candidate]) -> MergedDetection {
        let mut views: Vec<usize> = self
            .members
            .iter()
            .map(|index| candidates[*index].view)
            .collect();
        views.sort_unstable();
        views.dedup();
        #[expect(
            clippy::cast_precision_loss,
            reason = "a plan has far fewer than 2⁵³ views"
        )]
        let agreement = views.len() as f64 / self.expected_views;
        MergedDetection {
            bbox: self.bbox,
            score: self.best_score * agreement.sqrt().min(1.0),
            members: self.members,
        }
    }
}

#[cfg(test)]
mod tests;
