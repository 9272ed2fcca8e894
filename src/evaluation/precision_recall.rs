//! Precision and recall as the score threshold falls.

use std::num::NonZeroUsize;

use super::{EvaluatedImage, MatchingRule, Outcome, Region};

/// Precision and recall over all images after each detection, by descending score. Of equal
/// scores, earlier images go first, then earlier detections.
#[derive(Debug, Clone, PartialEq)]
pub struct PrecisionRecallCurve {
    points: Vec<OperatingPoint>,
}

/// What a score threshold yields.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OperatingPoint {
    /// The score of the last detection that counts.
    pub score: f64,
    /// The share of detections that are right, 0 to 1.
    pub precision: f64,
    /// The share of persons that are found, 0 to 1.
    pub recall: f64,
    /// Harmonic mean of precision and recall, 0 to 1.
    pub f1: f64,
}

impl PrecisionRecallCurve {
    /// The curve at `O_t` = `min_iou`; `None` without persons to find, where recall means nothing.
    #[must_use]
    pub fn of_images<B: Region>(
        images: &[EvaluatedImage<B>],
        rule: MatchingRule,
        min_iou: f64,
    ) -> Option<Self> {
        let persons = images.iter().map(|image| image.truth.person_count()).sum();
        let outcomes = images.iter().flat_map(|image| {
            let outcomes = rule.outcomes(&image.detections, &image.truth, min_iou);
            let scores = image.detections.iter().map(|detection| detection.score);
            scores.zip(outcomes)
        });
        Self::of_outcomes(outcomes, persons)
    }

    /// The curve of scores and outcomes, image by image; `None` without persons to find.
    pub(super) fn of_outcomes(
        outcomes: impl Iterator<Item = (f64, Outcome)>,
        persons: usize,
    ) -> Option<Self> {
        let persons = NonZeroUsize::new(persons)?;
        let counted = outcomes
            .filter(|(_, outcome)| *outcome != Outcome::Ignored)
            .map(|(score, outcome)| (score, outcome == Outcome::TruePositive))
            .collect();
        Some(Self::of_detections(counted, persons))
    }

    /// The curve of `(score, is right)` pairs.
    fn of_detections(mut detections: Vec<(f64, bool)>, persons: NonZeroUsize) -> Self {
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

    /// The points, by descending score.
    #[must_use]
    pub fn points(&self) -> &[OperatingPoint] {
        &self.points
    }

    /// The recall when every detection counts, 0 to 1.
    #[must_use]
    pub fn final_recall(&self) -> f64 {
        self.points.last().map_or(0.0, |point| point.recall)
    }

    /// The point of greatest F1, of equal ones that of the highest score; `None` without
    /// detections. Only points that a threshold can reach count: a threshold cannot part equal
    /// scores.
    #[must_use]
    pub fn best_f1(&self) -> Option<OperatingPoint> {
        self.points
            .chunk_by(|a, b| a.score.total_cmp(&b.score).is_eq())
            .filter_map(|equal_scores| equal_scores.last().copied())
            .reduce(|best, point| if point.f1 > best.f1 { point } else { best })
    }
}

/// A count as a number to calculate with.
pub(super) fn count(count: usize) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "far fewer than 2⁵³ of anything")]
    let count = count as f64;
    count
}

#[cfg(test)]
mod tests;
