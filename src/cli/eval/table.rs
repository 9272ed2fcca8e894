//! The figures of a row, as printed.

use std::fmt;

use lookdown_detect::{detection::Refinement, parameters::Profile};
use lookdown_eval::{DetectedRow, EvaluatedRow, Stratification, Stratum};
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
    /// Areas under the precision-recall curve, all points.
    ap50: f64,
    ap75: f64,
    ap50_95: f64,
    ap50_eleven_point: f64,
    /// Means at COCO's 101 recalls.
    ap50_coco: f64,
    ap75_coco: f64,
    ap50_95_coco: f64,
    f1: f64,
    /// The score threshold of `f1`, with precision and recall there.
    f1_score_threshold: Option<f64>,
    f1_precision: f64,
    f1_recall: f64,
    recall: f64,
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
    pub(super) fn new(detected: &'a DetectedRow, evaluated: &EvaluatedRow) -> Self {
        let summary = &evaluated.summary;
        let (name, numbers, cost) = (&detected.name, detected.refinement, detected.cost);
        Self {
            profile: name.profile.map(Profile::name),
            refine: name.refinement.map(Refinement::name),
            model: &name.model,
            score_threshold: numbers.map(|numbers| numbers.score_threshold),
            iou_threshold: numbers.map(|numbers| numbers.iou_threshold),
            sigma: numbers.map(|numbers| numbers.sigma),
            images: summary.images,
            persons: summary.persons,
            views: cost.map(|cost| cost.views),
            ap50: summary.ap50.all_point_area,
            ap75: summary.ap75.all_point_area,
            ap50_95: summary.ap50_95.all_point_area,
            ap50_eleven_point: summary.ap50.eleven_point,
            ap50_coco: summary.ap50.coco_101_point,
            ap75_coco: summary.ap75.coco_101_point,
            ap50_95_coco: summary.ap50_95.coco_101_point,
            f1: summary.f1,
            f1_score_threshold: summary.f1_score_threshold,
            f1_precision: summary.f1_precision,
            f1_recall: summary.f1_recall,
            recall: summary.recall,
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

/// The header of a sweep.
pub(super) const SWEEP_HEAD: &str =
    "refine               C_t    N_t  sigma   AP50   AP75  AP50:95     F1  recall";

impl Row<'_> {
    /// The line of a cell of a sweep. Each refinement shows the parameters that it uses.
    pub(super) fn sweep_line(&self) -> String {
        let refine = self.refine.unwrap_or("-");
        let is_gaussian = refine == Refinement::SoftNmsGaussian.name();
        format!(
            "{refine:<18} {:>5} {:>6} {:>6} {:>6.3} {:>6.3} {:>8.3} {:>6.3} {:>7.3}",
            number(self.score_threshold, 2),
            number(self.iou_threshold.filter(|_| !is_gaussian), 1),
            number(self.sigma.filter(|_| is_gaussian), 1),
            self.ap50,
            self.ap75,
            self.ap50_95,
            self.f1,
            self.recall,
        )
    }
}

fn number(value: Option<f64>, decimals: usize) -> String {
    match value {
        Some(value) => format!("{value:.decimals$}"),
        None => "-".to_owned(),
    }
}

/// The header of the table.
pub(super) const HEAD: &str = "\
profile   refine             model                  views   AP50   AP75  AP50:95     F1  recall  s/image";

impl fmt::Display for Row<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:<9} {:<18} {:<21} {:>6} {:>6.3} {:>6.3} {:>8.3} {:>6.3} {:>7.3} {:>8}",
            self.profile.unwrap_or("-"),
            self.refine.unwrap_or("-"),
            self.model,
            number(self.views, 1),
            self.ap50,
            self.ap75,
            self.ap50_95,
            self.f1,
            self.recall,
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
