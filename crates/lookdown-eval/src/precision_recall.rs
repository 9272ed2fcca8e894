//! Precision and recall for decreasing score thresholds.

use std::num::NonZeroUsize;

use crate::{EvaluatedImage, Outcome, Region, matching::outcomes};

/// Precision and recall over all images after each detection, by descending score. Detections of
/// equal score are ordered by image, then by position.
#[derive(Debug, Clone, PartialEq)]
pub struct PrecisionRecallCurve {
    /// The points, by descending score.
    pub points: Vec<OperatingPoint>,
}

/// The result of a score threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OperatingPoint {
    /// The lowest score that reaches the threshold.
    pub score: f64,
    /// The fraction of detections that are right, 0 to 1.
    pub precision: f64,
    /// The fraction of persons that are detected, 0 to 1.
    pub recall: f64,
    /// Harmonic mean of precision and recall, 0 to 1.
    pub f1: f64,
}

impl PrecisionRecallCurve {
    /// Returns the curve at `O_t` = `min_iou`. `None` if no person counts, as recall is undefined
    /// then.
    pub fn from_images<B: Region>(images: &[EvaluatedImage<B>], min_iou: f64) -> Option<Self> {
        let persons = images.iter().map(|image| image.truth.person_count()).sum();
        let outcomes = images.iter().flat_map(|image| {
            let outcomes = outcomes(&image.detections, &image.truth, min_iou);
            let scores = image.detections.iter().map(|detection| detection.score);
            scores.zip(outcomes)
        });
        Self::from_outcomes(outcomes, persons)
    }

    /// Returns the curve of scores and outcomes, image by image. `None` if no person counts.
    pub(super) fn from_outcomes(
        outcomes: impl Iterator<Item = (f64, Outcome)>,
        persons: usize,
    ) -> Option<Self> {
        let persons = NonZeroUsize::new(persons)?;
        let counted = outcomes
            .filter(|(_, outcome)| *outcome != Outcome::Ignored)
            .map(|(score, outcome)| (score, outcome == Outcome::TruePositive))
            .collect();
        Some(Self::from_detections(counted, persons))
    }

    /// Returns the curve of `(score, is right)` pairs.
    fn from_detections(mut detections: Vec<(f64, bool)>, persons: NonZeroUsize) -> Self {
        detections.sort_by(|a, b| b.0.total_cmp(&a.0));
        let persons = count(persons.get());
        let (mut right, mut all) = (0.0, 0.0);
        let points = detections
            .into_iter()
            .map(|(score, is_right)| {
                right += f64::from(u8::from(is_right));
                all += 1.0;
                OperatingPoint {
                    score,
                    precision: right / all,
                    recall: right / persons,
                    f1: 2.0 * right / (all + persons),
                }
            })
            .collect();
        Self { points }
    }

    /// The recall of all detections, 0 to 1.
    pub fn final_recall(&self) -> f64 {
        self.points.last().map_or(0.0, |point| point.recall)
    }

    /// The point of greatest F1, of equal ones that of the highest score. `None` without
    /// detections. A threshold cannot separate equal scores, so only the last point of each score
    /// counts.
    pub fn best_f1(&self) -> Option<OperatingPoint> {
        self.points
            .chunk_by(|a, b| a.score.total_cmp(&b.score).is_eq())
            .filter_map(|equal_scores| equal_scores.last().copied())
            .reduce(|best, point| if point.f1 > best.f1 { point } else { best })
    }
}

/// Converts a count to a floating-point number.
pub(super) fn count(count: usize) -> f64 {
    count as f64
}

/// The average precision of one curve. In all three definitions the precision at a recall is the
/// maximum at that recall or a higher one (the envelope).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AveragePrecision {
    /// Area under the envelope: PASCAL VOC from 2010 on.
    pub all_point_area: f64,
    /// Mean at recall 0, 0.1 … 1: PASCAL VOC until 2009 (Everingham et al., IJCV 2010, eq. 1).
    pub eleven_point: f64,
    /// Mean at recall 0, 0.01 … 1: COCO.
    pub coco_101_point: f64,
}

impl PrecisionRecallCurve {
    /// The average precision of this curve, 0 to 1.
    pub fn average_precision(&self) -> AveragePrecision {
        let envelope = self.envelope();
        AveragePrecision {
            all_point_area: area(&envelope),
            eleven_point: mean_at(&envelope, (0..=10_u8).map(|level| f64::from(level) / 10.0)),
            // A product, not a quotient: it equals the levels of `pycocotools` to the last bit.
            coco_101_point: mean_at(&envelope, (0..=100_u8).map(|level| f64::from(level) * 0.01)),
        }
    }

    /// `(recall, envelope precision)` of each point, by ascending recall.
    pub fn envelope(&self) -> Vec<(f64, f64)> {
        let mut greatest: f64 = 0.0;
        let mut envelope: Vec<(f64, f64)> = self
            .points
            .iter()
            .rev()
            .map(|point| {
                greatest = greatest.max(point.precision);
                (point.recall, greatest)
            })
            .collect();
        envelope.reverse();
        envelope
    }
}

fn area(envelope: &[(f64, f64)]) -> f64 {
    let mut previous_recall = 0.0;
    let mut area = 0.0;
    for (recall, precision) in envelope {
        area += (recall - previous_recall) * precision;
        previous_recall = *recall;
    }
    area
}

/// The mean envelope precision at recall levels. It is 0 at levels that are not reached.
fn mean_at(envelope: &[(f64, f64)], levels: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = count(levels.len());
    let sum: f64 = levels
        .map(|level| {
            let reached = envelope.partition_point(|(recall, _)| *recall < level);
            envelope
                .get(reached)
                .map_or(0.0, |(_, precision)| *precision)
        })
        .sum();
    sum / count
}

#[cfg(test)]
mod tests;
