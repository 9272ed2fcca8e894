//! The responses that DeepStack's clients read.

use serde::Serialize;
use utoipa::ToSchema;

use crate::{
    api::report::{Report, ReportPerson},
    calibration_store::CalibrationRow,
};

const LABEL: &str = "person";
const MILLIS_PER_SECOND: f64 = 1000.0;

/// The persons in one frame, in DeepStack's format.
#[derive(Debug, Serialize, ToSchema)]
#[schema(example = json!({
    "success": true,
    "predictions": [{
        "label": "person", "confidence": 0.8731,
        "x_min": 1102, "y_min": 700, "x_max": 1342, "y_max": 843
    }],
    "duration": 0.614
}))]
pub(in crate::api) struct DeepStackAnswer {
    /// Always true; failures have false.
    success: bool,
    /// Persons, highest confidence first.
    predictions: Vec<DeepStackPrediction>,
    /// Time from the arrival of the frame to its report, seconds.
    duration: f64,
}

/// A person.
#[derive(Debug, PartialEq, Serialize, ToSchema)]
pub(in crate::api) struct DeepStackPrediction {
    /// Always `person`.
    label: &'static str,
    /// The score, 0 to 1.
    confidence: f64,
    /// Left edge, pixels of the frame.
    x_min: i64,
    /// Top edge.
    y_min: i64,
    /// Right edge.
    x_max: i64,
    /// Bottom edge.
    y_max: i64,
}

impl From<&Report> for DeepStackAnswer {
    fn from(report: &Report) -> Self {
        Self {
            success: true,
            predictions: report.persons.iter().map(Into::into).collect(),
            duration: report.timings_ms.total / MILLIS_PER_SECOND,
        }
    }
}

impl From<&ReportPerson> for DeepStackPrediction {
    /// These clients expect whole pixels. The box is rounded outwards, within the frame.
    fn from(person: &ReportPerson) -> Self {
        let bbox = &person.bbox;
        Self {
            label: LABEL,
            confidence: person.score,
            x_min: whole(bbox.x_min.floor()),
            y_min: whole(bbox.y_min.floor()),
            x_max: whole(bbox.x_max.ceil()),
            y_max: whole(bbox.y_max.ceil()),
        }
    }
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "boxes lie within the frame"
)]
fn whole(pixels: f64) -> i64 {
    pixels as i64
}

/// The calibrations, in place of custom models.
#[derive(Debug, Serialize, ToSchema)]
pub(in crate::api) struct DeepStackModels {
    /// Always true; failures have false.
    success: bool,
    /// The IDs of the calibrations in use.
    models: Vec<String>,
}

impl FromIterator<CalibrationRow> for DeepStackModels {
    fn from_iter<T: IntoIterator<Item = CalibrationRow>>(rows: T) -> Self {
        let serving = rows.into_iter().filter(|row| row.entry.is_some());
        Self {
            success: true,
            models: serving.map(|row| row.id.to_string()).collect(),
        }
    }
}
