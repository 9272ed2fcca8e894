//! The figures of a row, as printed.

use std::fmt;

use lookdown_detect::{detection::Refinement, parameters::Profile};
use lookdown_eval::{
    AveragePrecision, Counts, DEFAULT_COUNT_THRESHOLD, DetectedRow, EvaluatedRow, Stratification,
    Stratum,
};
use serde::Serialize;

/// One row: a JSON object, or a line of the table by its `Display`. Unknown values of detections
/// from a file are null, or a dash.
#[derive(Debug, Serialize)]
pub(super) struct Row<'a> {
    profile: Option<&'static str>,
    refine: Option<&'static str>,
    model: &'a str,
    score_threshold: Option<f64>,
    iou_threshold: Option<f64>,
    sigma: Option<f64>,
    images: usize,
    persons: usize,
    /// Views per image that ran through the network.
    views: Option<f64>,
    /// Areas under the precision-recall curve, all points. These and the following figures are null
    /// if no person counts.
    ap50: Option<f64>,
    ap75: Option<f64>,
    ap50_95: Option<f64>,
    ap50_eleven_point: Option<f64>,
    /// Means at COCO's 101 recalls.
    ap50_coco: Option<f64>,
    ap75_coco: Option<f64>,
    ap50_95_coco: Option<f64>,
    f1: Option<f64>,
    /// The score threshold of `f1`, with precision and recall there.
    f1_score_threshold: Option<f64>,
    f1_precision: Option<f64>,
    f1_recall: Option<f64>,
    recall: Option<f64>,
    /// The counts at this threshold.
    count_threshold: f64,
    /// Mean numbers per image.
    false_persons: f64,
    missed_persons: f64,
    /// Mean absolute error of the number of persons of an image.
    count_error: f64,
    empty_images: usize,
    /// The share of the images without persons that have a false person.
    false_in_empty_images: Option<f64>,
    /// The threshold of the least count error, and that error.
    best_count_threshold: f64,
    best_count_error: f64,
    /// The expected calibration error of the scores, and that of exact probabilities.
    calibration_error: Option<f64>,
    calibration_error_by_chance: Option<f64>,
    /// Processing time of an image, without waiting for concurrent ones.
    seconds_per_image: Option<f64>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    strata: Vec<StratumRow>,
}

/// The figures of one stratum. They are null, or a dash, if no person counts.
#[derive(Debug, Serialize)]
struct StratumRow {
    by: &'static str,
    stratum: &'static str,
    persons: usize,
    ap50: Option<f64>,
    recall: Option<f64>,
}

impl<'a> Row<'a> {
    /// `evaluated` is `None` if no person counts.
    pub(super) fn new(
        detected: &'a DetectedRow,
        evaluated: Option<&EvaluatedRow>,
        counts: &Counts,
    ) -> Self {
        let summary = evaluated.map(|evaluated| &evaluated.summary);
        let (name, numbers, cost) = (&detected.name, detected.refinement, detected.cost);
        let (now, best) = (counts.at(DEFAULT_COUNT_THRESHOLD), counts.best());
        let calibration = counts.calibration_error();
        let area = |ap: AveragePrecision| ap.all_point_area;
        let coco = |ap: AveragePrecision| ap.coco_101_point;
        Self {
            profile: name.profile.map(Profile::name),
            refine: name.refinement.map(Refinement::name),
            model: &name.model,
            score_threshold: numbers.map(|numbers| numbers.score_threshold),
            iou_threshold: numbers.map(|numbers| numbers.iou_threshold),
            sigma: numbers.map(|numbers| numbers.sigma),
            images: counts.image_count(),
            persons: summary.map_or(0, |summary| summary.persons),
            views: cost.map(|cost| cost.views),
            ap50: summary.map(|summary| area(summary.ap50)),
            ap75: summary.map(|summary| area(summary.ap75)),
            ap50_95: summary.map(|summary| area(summary.ap50_95)),
            ap50_eleven_point: summary.map(|summary| summary.ap50.eleven_point),
            ap50_coco: summary.map(|summary| coco(summary.ap50)),
            ap75_coco: summary.map(|summary| coco(summary.ap75)),
            ap50_95_coco: summary.map(|summary| coco(summary.ap50_95)),
            f1: summary.map(|summary| summary.f1),
            f1_score_threshold: summary.and_then(|summary| summary.f1_score_threshold),
            f1_precision: summary.map(|summary| summary.f1_precision),
            f1_recall: summary.map(|summary| summary.f1_recall),
            recall: summary.map(|summary| summary.recall),
            count_threshold: now.score_threshold,
            false_persons: now.false_persons,
            missed_persons: now.missed_persons,
            count_error: now.count_error,
            empty_images: counts.empty_image_count(),
            false_in_empty_images: now.false_in_empty_images,
            best_count_threshold: best.score_threshold,
            best_count_error: best.count_error,
            calibration_error: calibration.map(|calibration| calibration.error),
            calibration_error_by_chance: calibration.map(|calibration| calibration.by_chance),
            seconds_per_image: cost.map(|cost| cost.time_per_image.as_secs_f64()),
            strata: Vec::new(),
        }
    }

    /// Adds the figures of strata of one kind.
    pub(super) fn add_strata(&mut self, by: Stratification, strata: &[Stratum]) {
        self.strata.extend(strata.iter().map(|stratum| StratumRow {
            by: by.name(),
            stratum: stratum.name,
            persons: stratum.persons,
            ap50: stratum.figures.map(|figures| figures.ap50.all_point_area),
            recall: stratum.figures.map(|figures| figures.recall),
        }));
    }
}

fn number(value: Option<f64>, decimals: usize) -> String {
    match value {
        Some(value) => format!("{value:.decimals$}"),
        None => "-".to_owned(),
    }
}

/// The header of the table. `docs/evaluate.md` explains the columns.
pub(super) const HEAD: &str = "\
profile   refine             model                  views   AP50   AP75  AP50:95     F1  recall  \
false missed  error  empty   best    at    ECE  s/image";

impl fmt::Display for Row<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:<9} {:<18} {:<21} {:>6} {:>6} {:>6} {:>8} {:>6} {:>7} {:>6} {:>6} {:>6} {:>6} {:>6} \
             {:>5} {:>6} {:>8}",
            self.profile.unwrap_or("-"),
            self.refine.unwrap_or("-"),
            self.model,
            number(self.views, 1),
            number(self.ap50, 3),
            number(self.ap75, 3),
            number(self.ap50_95, 3),
            number(self.f1, 3),
            number(self.recall, 3),
            number(Some(self.false_persons), 2),
            number(Some(self.missed_persons), 2),
            number(Some(self.count_error), 2),
            number(self.false_in_empty_images, 2),
            number(Some(self.best_count_error), 2),
            number(Some(self.best_count_threshold), 2),
            number(self.calibration_error, 3),
            number(self.seconds_per_image, 3),
        )?;
        for stratum in &self.strata {
            write!(
                f,
                "\n  {:<42} persons {:>5}  AP50 {:>5}  recall {:>5}",
                stratum.stratum,
                stratum.persons,
                number(stratum.ap50, 3),
                number(stratum.recall, 3),
            )?;
        }
        Ok(())
    }
}
