//! The number of persons in a frame, and scores as probabilities.
//!
//! Average precision considers every score. A user reads the persons above one threshold.

use lookdown_lens::saturating::to_usize;

use super::{EvaluatedImage, Outcome, Region, matching::outcomes, precision_recall::count};

/// The score threshold of a detection that sets none.
pub const DEFAULT_COUNT_THRESHOLD: f64 = 0.3;
/// `O_t` of a right detection.
const MIN_IOU: f64 = 0.5;
/// The thresholds that are compared, in hundredths.
const HUNDREDTHS: std::ops::RangeInclusive<u8> = 1..=99;
/// Bins of the calibration error.
const BINS: usize = 10;
/// The lowest score in the calibration error.
const CALIBRATION_FLOOR: f64 = 0.05;

/// The outcomes of the detections of all images. Ignored detections are left out.
#[derive(Debug, Clone, PartialEq)]
pub struct Counts {
    images: Vec<CountedImage>,
}

/// The persons of one image, and its detections that are right or wrong.
#[derive(Debug, Clone, PartialEq)]
struct CountedImage {
    persons: usize,
    /// Score, and true if the detection is right.
    detections: Vec<(f64, bool)>,
}

/// The counts at a score threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CountFigures {
    /// The score threshold.
    pub score_threshold: f64,
    /// Mean number of false detections per image.
    pub false_persons: f64,
    /// Mean number of missed persons per image.
    pub missed_persons: f64,
    /// Mean absolute difference between the numbers of detections and of persons of an image.
    pub count_error: f64,
    /// The share of the images without persons that have a false detection. `None` if every image
    /// has persons.
    pub false_in_empty_images: Option<f64>,
}

/// The expected calibration error: the mean difference between score and share of right detections
/// in ten bins, weighted by their detections (Guo et al., "On Calibration of Modern Neural
/// Networks", ICML 2017). Detections below a score of 0.05 are left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CalibrationError {
    /// The error.
    pub error: f64,
    /// The mean error of exact probabilities with as many detections (normal approximation).
    pub by_chance: f64,
}

impl Counts {
    /// Matches the detections of `images` at `O_t` = 0.5.
    pub fn from_images<B: Region>(images: &[EvaluatedImage<B>]) -> Self {
        let counted = images.iter().map(|image| {
            let outcomes = outcomes(&image.detections, &image.truth, MIN_IOU);
            let judged = image.detections.iter().zip(outcomes);
            CountedImage {
                persons: image.truth.person_count(),
                detections: judged
                    .filter(|(_, outcome)| *outcome != Outcome::Ignored)
                    .map(|(detection, outcome)| (detection.score, outcome == Outcome::TruePositive))
                    .collect(),
            }
        });
        Self {
            images: counted.collect(),
        }
    }

    /// Returns the number of images.
    pub fn image_count(&self) -> usize {
        self.images.len()
    }

    /// Returns the number of images without persons.
    pub fn empty_image_count(&self) -> usize {
        let empty = self.images.iter().filter(|image| image.persons == 0);
        empty.count()
    }

    /// Returns the counts of detections with at least this score.
    pub fn at(&self, score_threshold: f64) -> CountFigures {
        let (mut wrong, mut missed, mut error, mut disturbed) = (0, 0, 0, 0);
        for image in &self.images {
            let kept = image.detections.iter();
            let kept = kept.filter(|(score, _)| *score >= score_threshold);
            let (all, right) = kept.fold((0, 0), |(all, right), (_, is_right)| {
                (all + 1, right + usize::from(*is_right))
            });
            wrong += all - right;
            missed += image.persons - right;
            error += all.abs_diff(image.persons);
            disturbed += usize::from(image.persons == 0 && all > 0);
        }
        let images = count(self.images.len().max(1));
        let empty = self.empty_image_count();
        CountFigures {
            score_threshold,
            false_persons: count(wrong) / images,
            missed_persons: count(missed) / images,
            count_error: count(error) / images,
            false_in_empty_images: (empty > 0).then(|| count(disturbed) / count(empty)),
        }
    }

    /// Returns the counts at the threshold of the least count error, in hundredths. Of equal ones
    /// it is the nearest to the default threshold.
    pub fn best(&self) -> CountFigures {
        let distance =
            |figures: &CountFigures| (figures.score_threshold - DEFAULT_COUNT_THRESHOLD).abs();
        HUNDREDTHS
            .map(|hundredths| self.at(f64::from(hundredths) / 100.0))
            .fold(self.at(DEFAULT_COUNT_THRESHOLD), |best, figures| {
                let by_error = figures.count_error.total_cmp(&best.count_error);
                let order = by_error.then(distance(&figures).total_cmp(&distance(&best)));
                if order.is_lt() { figures } else { best }
            })
    }

    /// Returns the calibration error; `None` without detections.
    pub fn calibration_error(&self) -> Option<CalibrationError> {
        let mut bins = [Bin::default(); BINS];
        let detections = self.images.iter().flat_map(|image| &image.detections);
        for &(score, is_right) in detections.filter(|(score, _)| *score >= CALIBRATION_FLOOR) {
            let index = to_usize(score * count(BINS));
            bins[index.min(BINS - 1)].add(score, is_right);
        }
        let all: f64 = bins.iter().map(|bin| bin.detections).sum();
        (all > 0.0).then(|| CalibrationError {
            error: bins.iter().map(Bin::surplus).sum::<f64>() / all,
            by_chance: bins.iter().map(Bin::surplus_by_chance).sum::<f64>() / all,
        })
    }
}

/// The detections of a range of scores.
#[derive(Debug, Clone, Copy, Default)]
struct Bin {
    detections: f64,
    scores: f64,
    right: f64,
    /// The variance of the number of right detections if scores are exact probabilities.
    variance: f64,
}

impl Bin {
    fn add(&mut self, score: f64, is_right: bool) {
        self.detections += 1.0;
        self.scores += score;
        self.right += f64::from(u8::from(is_right));
        self.variance += score * (1.0 - score);
    }

    /// The difference between the expected and the actual number of right detections.
    fn surplus(&self) -> f64 {
        (self.scores - self.right).abs()
    }

    /// The mean of that difference if scores are exact probabilities: that of the half-normal
    /// distribution.
    fn surplus_by_chance(&self) -> f64 {
        (2.0 * self.variance / std::f64::consts::PI).sqrt()
    }
}

#[cfg(test)]
mod tests;
