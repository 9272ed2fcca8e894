//! Which detections of an image count as right.

use super::{GroundTruth, Region, ScoredBox};

/// COCO lowers a threshold of 1 by this much, so that rounding cannot part equal boxes.
const COCO_MARGIN: f64 = 1e-10;

/// How a detection counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// It found a person no better detection had found.
    TruePositive,
    /// It found nothing, or a person found before.
    FalsePositive,
    /// It lies in an ignore region: neither.
    Ignored,
}

/// Which person a detection is compared with. Detections take their turns by descending score.
///
/// In both rules a detection that no person decides is ignored when at least the threshold's
/// share of its area lies in an ignore region.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MatchingRule {
    /// PASCAL VOC (Everingham et al., IJCV 2010): the person of greatest IoU, of equal ones the
    /// first, decides. If another detection has it, this one is a duplicate: a false positive.
    Voc,
    /// COCO (as in `pycocotools`): the person of greatest IoU, of equal ones the last, among
    /// those not yet found.
    Coco,
}

impl MatchingRule {
    /// The outcome of each detection of one image, in the order of `detections`. A match needs
    /// at least `min_iou` (`O_t`).
    #[must_use]
    pub fn outcomes<B: Region>(
        self,
        detections: &[ScoredBox<B>],
        truth: &GroundTruth<B>,
        min_iou: f64,
    ) -> Vec<Outcome> {
        let min_iou = match self {
            Self::Voc => min_iou,
            Self::Coco => min_iou.min(1.0 - COCO_MARGIN),
        };
        let mut order: Vec<usize> = (0..detections.len()).collect();
        order.sort_by(|a, b| detections[*b].score.total_cmp(&detections[*a].score));

        let mut found = vec![false; truth.persons.len()];
        let mut outcomes = vec![Outcome::FalsePositive; detections.len()];
        for index in order {
            let bbox = &detections[index].bbox;
            let person = match self {
                Self::Voc => nearest_person(bbox, truth, min_iou),
                Self::Coco => nearest_free_person(bbox, truth, min_iou, &found),
            };
            outcomes[index] = match person {
                Some(person) if found[person] => Outcome::FalsePositive,
                Some(person) => {
                    found[person] = true;
                    Outcome::TruePositive
                }
                None if lies_in_ignore_region(bbox, truth, min_iou) => Outcome::Ignored,
                None => Outcome::FalsePositive,
            };
        }
        outcomes
    }
}

fn nearest_person<B: Region>(bbox: &B, truth: &GroundTruth<B>, min_iou: f64) -> Option<usize> {
    let mut nearest = None;
    let mut greatest = f64::NEG_INFINITY;
    for (index, person) in truth.persons.iter().enumerate() {
        let iou = bbox.iou(person);
        if iou >= min_iou && iou > greatest {
            greatest = iou;
            nearest = Some(index);
        }
    }
    nearest
}

fn nearest_free_person<B: Region>(
    bbox: &B,
    truth: &GroundTruth<B>,
    min_iou: f64,
    found: &[bool],
) -> Option<usize> {
    let mut nearest = None;
    let mut greatest = min_iou;
    for (index, person) in truth.persons.iter().enumerate() {
        let iou = bbox.iou(person);
        if !found[index] && iou >= greatest {
            greatest = iou;
            nearest = Some(index);
        }
    }
    nearest
}

fn lies_in_ignore_region<B: Region>(bbox: &B, truth: &GroundTruth<B>, min_share: f64) -> bool {
    truth
        .ignore_regions
        .iter()
        .any(|region| bbox.share_in(region) >= min_share)
}

#[cfg(test)]
mod tests;
