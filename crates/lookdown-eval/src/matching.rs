//! Matches the detections of an image with its persons.

use super::{GroundTruth, Region, ScoredBox};

/// COCO lowers a threshold of 1 by this margin, so that rounding cannot separate equal boxes.
const COCO_MARGIN: f64 = 1e-10;

/// The outcome of a detection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// It matches a person that no better detection has matched.
    TruePositive,
    /// It matches no person, or one that was matched before.
    FalsePositive,
    /// It matches a person that does not count, or lies in an ignore region.
    Ignored,
}

/// The rule that selects the person for a detection. Detections are processed by descending score.
///
/// In both rules a detection is ignored if it matches a person that does not count. It is also
/// ignored if no person decides it and at least the threshold's share of its area is in an ignore
/// region.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MatchingRule {
    /// PASCAL VOC (Everingham et al., IJCV 2010): the person of greatest IoU decides, of equal ones
    /// the first. If it has another detection, this one is a duplicate, a false positive. A person
    /// that does not count may be matched any number of times.
    Voc,
    /// COCO (as in `pycocotools`): the unmatched person of greatest IoU decides, of equal ones the
    /// last. Persons that do not count are considered only if no counting person qualifies.
    Coco,
}

impl MatchingRule {
    /// Returns the outcome of each detection of one image, in the order of `detections`. A match
    /// needs at least `min_iou` (`O_t`).
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
            outcomes[index] = match self {
                Self::Voc => voc_outcome(bbox, truth, min_iou, &mut found),
                Self::Coco => coco_outcome(bbox, truth, min_iou, &mut found),
            };
        }
        outcomes
    }
}

fn voc_outcome<B: Region>(
    bbox: &B,
    truth: &GroundTruth<B>,
    min_iou: f64,
    found: &mut [bool],
) -> Outcome {
    let mut nearest = None;
    let mut greatest = f64::NEG_INFINITY;
    for (index, person) in truth.persons.iter().enumerate() {
        let iou = bbox.iou(&person.outline);
        if iou >= min_iou && iou > greatest {
            greatest = iou;
            nearest = Some(index);
        }
    }
    match nearest {
        Some(person) if !truth.persons[person].counts => Outcome::Ignored,
        Some(person) if found[person] => Outcome::FalsePositive,
        Some(person) => {
            found[person] = true;
            Outcome::TruePositive
        }
        None if greatest_share_in_ignore_region(bbox, truth) >= min_iou => Outcome::Ignored,
        None => Outcome::FalsePositive,
    }
}

fn coco_outcome<B: Region>(
    bbox: &B,
    truth: &GroundTruth<B>,
    min_iou: f64,
    found: &mut [bool],
) -> Outcome {
    if let Some((person, _)) = nearest_free(bbox, truth, min_iou, found, true) {
        found[person] = true;
        return Outcome::TruePositive;
    }
    let share = greatest_share_in_ignore_region(bbox, truth);
    match nearest_free(bbox, truth, min_iou, found, false) {
        Some((person, iou)) if iou >= share => {
            found[person] = true;
            Outcome::Ignored
        }
        // A detection that overlaps an ignore region more than a person does not consume the
        // person.
        _ if share >= min_iou => Outcome::Ignored,
        _ => Outcome::FalsePositive,
    }
}

/// The unmatched person of greatest IoU, and that IoU, among those that do or do not count.
fn nearest_free<B: Region>(
    bbox: &B,
    truth: &GroundTruth<B>,
    min_iou: f64,
    found: &[bool],
    counts: bool,
) -> Option<(usize, f64)> {
    let mut nearest = None;
    let mut greatest = min_iou;
    for (index, person) in truth.persons.iter().enumerate() {
        if found[index] || person.counts != counts {
            continue;
        }
        let iou = bbox.iou(&person.outline);
        if iou >= greatest {
            greatest = iou;
            nearest = Some((index, iou));
        }
    }
    nearest
}

fn greatest_share_in_ignore_region<B: Region>(bbox: &B, truth: &GroundTruth<B>) -> f64 {
    truth
        .ignore_regions
        .iter()
        .map(|region| bbox.share_in(region))
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests;
