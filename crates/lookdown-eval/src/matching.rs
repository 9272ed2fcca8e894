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

/// Returns the outcome of each detection of one image, in the order of `detections`. A match needs
/// at least `min_iou` (`O_t`).
///
/// Detections are processed by descending score, as in `pycocotools`. The unmatched person of
/// greatest IoU decides, of equal ones the last. Persons that do not count are considered only if
/// no counting person qualifies. A detection is ignored if it matches such a person. It is also
/// ignored if no person decides it and at least the threshold's share of its area is in an ignore
/// region.
pub fn outcomes<B: Region>(
    detections: &[ScoredBox<B>],
    truth: &GroundTruth<B>,
    min_iou: f64,
) -> Vec<Outcome> {
    let min_iou = min_iou.min(1.0 - COCO_MARGIN);
    let mut order: Vec<usize> = (0..detections.len()).collect();
    order.sort_by(|a, b| detections[*b].score.total_cmp(&detections[*a].score));

    let mut found = vec![false; truth.persons.len()];
    let mut outcomes = vec![Outcome::FalsePositive; detections.len()];
    for index in order {
        outcomes[index] = outcome(&detections[index].bbox, truth, min_iou, &mut found);
    }
    outcomes
}

fn outcome<B: Region>(
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
