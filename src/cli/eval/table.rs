//! The figures of a row, as printed.

use std::fmt;

use lookdown_detect::{detection::Refinement, parameters::Profile};
use lookdown_eval::{
    Counts, DEFAULT_COUNT_THRESHOLD, DetectedRow, EvaluatedRow, Stratification, Stratum, Summary,
};
use serde_json::{Value, json};

/// One row: a JSON object, or a line of the table by its `Display`. Unknown values of detections
/// from a file are null, or a dash.
pub(super) struct Row<'a> {
    pub(super) detected: &'a DetectedRow,
    /// `None` if no person counts.
    pub(super) evaluated: Option<EvaluatedRow>,
    pub(super) counts: Counts,
    pub(super) strata: Vec<(Stratification, Vec<Stratum>)>,
}

impl Row<'_> {
    /// The row as JSON: the score thresholds of `f1` and of the counts stand beside them, numbers
    /// of false and missed persons are means per image, and `false_in_empty_images` is the share of
    /// the images without persons that have a false person.
    pub(super) fn json(&self) -> Value {
        let summary = self.evaluated.as_ref().map(|evaluated| &evaluated.summary);
        let figure = |figure: fn(&Summary) -> f64| summary.map(figure);
        let DetectedRow {
            name,
            refinement: numbers,
            cost,
            ..
        } = self.detected;
        let counts = &self.counts;
        let (now, best) = (counts.at(DEFAULT_COUNT_THRESHOLD), counts.best());
        let calibration = counts.calibration_error();
        let mut row = json!({
            "profile": name.profile.map(Profile::name),
            "refine": name.refinement.map(Refinement::name),
            "model": name.model,
            "score_threshold": numbers.map(|numbers| numbers.score_threshold),
            "iou_threshold": numbers.map(|numbers| numbers.iou_threshold),
            "sigma": numbers.map(|numbers| numbers.sigma),
            "images": counts.image_count(),
            "persons": summary.map_or(0, |summary| summary.persons),
            "views": cost.map(|cost| cost.views),
            "ap50": figure(|summary| summary.ap50.all_point_area),
            "ap75": figure(|summary| summary.ap75.all_point_area),
            "ap50_95": figure(|summary| summary.ap50_95.all_point_area),
            "ap50_eleven_point": figure(|summary| summary.ap50.eleven_point),
            "ap50_coco": figure(|summary| summary.ap50.coco_101_point),
            "ap75_coco": figure(|summary| summary.ap75.coco_101_point),
            "ap50_95_coco": figure(|summary| summary.ap50_95.coco_101_point),
            "f1": figure(|summary| summary.f1),
            "f1_score_threshold": summary.and_then(|summary| summary.f1_score_threshold),
            "f1_precision": figure(|summary| summary.f1_precision),
            "f1_recall": figure(|summary| summary.f1_recall),
            "recall": figure(|summary| summary.recall),
            "count_threshold": now.score_threshold,
            "false_persons": now.false_persons,
            "missed_persons": now.missed_persons,
            "count_error": now.count_error,
            "empty_images": counts.empty_image_count(),
            "false_in_empty_images": now.false_in_empty_images,
            "best_count_threshold": best.score_threshold,
            "best_count_error": best.count_error,
            "calibration_error": calibration.map(|calibration| calibration.error),
            "calibration_error_by_chance": calibration.map(|calibration| calibration.by_chance),
            "seconds_per_image": cost.map(|cost| cost.time_per_image.as_secs_f64()),
        });
        let strata = self.strata.iter();
        let strata =
            strata.flat_map(|(by, strata)| strata.iter().map(|stratum| stratum_json(*by, stratum)));
        let strata: Vec<_> = strata.collect();
        if !strata.is_empty() {
            row["strata"] = json!(strata);
        }
        row
    }
}

/// The figures of one stratum. They are null if no person counts.
fn stratum_json(by: Stratification, stratum: &Stratum) -> Value {
    json!({
        "by": by.name(),
        "stratum": stratum.name,
        "persons": stratum.persons,
        "ap50": stratum.figures.map(|figures| figures.ap50.all_point_area),
        "recall": stratum.figures.map(|figures| figures.recall),
    })
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
        let summary = self.evaluated.as_ref().map(|evaluated| &evaluated.summary);
        let figure = |figure: fn(&Summary) -> f64| number(summary.map(figure), 3);
        let DetectedRow { name, cost, .. } = self.detected;
        let counts = &self.counts;
        let (now, best) = (counts.at(DEFAULT_COUNT_THRESHOLD), counts.best());
        let calibration = counts.calibration_error();
        write!(
            f,
            "{:<9} {:<18} {:<21} {:>6} {:>6} {:>6} {:>8} {:>6} {:>7} {:>6.2} {:>6.2} {:>6.2} {:>6} \
             {:>6.2} {:>5.2} {:>6} {:>8}",
            name.profile.map_or("-", Profile::name),
            name.refinement.map_or("-", Refinement::name),
            name.model,
            number(cost.map(|cost| cost.views), 1),
            figure(|summary| summary.ap50.all_point_area),
            figure(|summary| summary.ap75.all_point_area),
            figure(|summary| summary.ap50_95.all_point_area),
            figure(|summary| summary.f1),
            figure(|summary| summary.recall),
            now.false_persons,
            now.missed_persons,
            now.count_error,
            number(now.false_in_empty_images, 2),
            best.count_error,
            best.score_threshold,
            number(calibration.map(|calibration| calibration.error), 3),
            number(cost.map(|cost| cost.time_per_image.as_secs_f64()), 3),
        )?;
        for stratum in self.strata.iter().flat_map(|(_, strata)| strata) {
            let figures = stratum.figures;
            write!(
                f,
                "\n  {:<42} persons {:>5}  AP50 {:>5}  recall {:>5}",
                stratum.name,
                stratum.persons,
                number(figures.map(|figures| figures.ap50.all_point_area), 3),
                number(figures.map(|figures| figures.recall), 3),
            )?;
        }
        Ok(())
    }
}
