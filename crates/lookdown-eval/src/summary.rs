//! The figures of a whole data set.

use super::{AveragePrecision, EvaluatedImage, PrecisionRecallCurve, Region};

/// No person counts in any image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the data set has no persons, so recall is undefined; annotate at least one")]
pub struct NoPersons;

/// The figures of the detections of a data set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summary {
    /// Number of images.
    pub images: usize,
    /// The number of persons that count.
    pub persons: usize,
    /// Average precision at `O_t` = 0.5.
    pub ap50: AveragePrecision,
    /// Average precision at `O_t` = 0.75.
    pub ap75: AveragePrecision,
    /// Average precision, mean over `O_t` = 0.5, 0.55 … 0.95.
    pub ap50_95: AveragePrecision,
    /// The greatest F1 of any score threshold at `O_t` = 0.5, 0 to 1.
    pub f1: f64,
    /// The score threshold of `f1`; `None` without detections.
    pub f1_score_threshold: Option<f64>,
    /// The fraction of detections that are right at that threshold, 0 to 1.
    pub f1_precision: f64,
    /// The fraction of persons detected at that threshold, 0 to 1.
    pub f1_recall: f64,
    /// The fraction of persons matched by any detection at `O_t` = 0.5, 0 to 1.
    pub recall: f64,
}

impl Summary {
    /// Returns the figures of `images`, matched as in `pycocotools`.
    ///
    /// # Errors
    /// [`NoPersons`] if no person counts.
    pub fn from_images<B: Region>(images: &[EvaluatedImage<B>]) -> Result<Self, NoPersons> {
        let curve_at = |percent: u8| {
            PrecisionRecallCurve::from_images(images, f64::from(percent) / 100.0).ok_or(NoPersons)
        };
        let average_at = |percent| Ok(curve_at(percent)?.average_precision());
        let at_50 = curve_at(50)?;
        let best = at_50.best_f1();
        Ok(Self {
            images: images.len(),
            persons: images.iter().map(|image| image.truth.person_count()).sum(),
            ap50: at_50.average_precision(),
            ap75: average_at(75)?,
            ap50_95: mean(
                &(50..100)
                    .step_by(5)
                    .map(average_at)
                    .collect::<Result<Vec<_>, _>>()?,
            ),
            f1: best.map_or(0.0, |point| point.f1),
            f1_score_threshold: best.map(|point| point.score),
            f1_precision: best.map_or(0.0, |point| point.precision),
            f1_recall: best.map_or(0.0, |point| point.recall),
            recall: at_50.final_recall(),
        })
    }
}

fn mean(all: &[AveragePrecision]) -> AveragePrecision {
    let mean_of = |definition: fn(&AveragePrecision) -> f64| {
        all.iter().map(definition).sum::<f64>() / super::precision_recall::count(all.len())
    };
    AveragePrecision {
        all_point_area: mean_of(|ap| ap.all_point_area),
        eleven_point: mean_of(|ap| ap.eleven_point),
        coco_101_point: mean_of(|ap| ap.coco_101_point),
    }
}
