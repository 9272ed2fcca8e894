//! The responses that DeepStack's clients read.

use lookdown_common::report::{Report, ReportPerson};
use serde::Serialize;
use utoipa::ToSchema;

use crate::calibration_store::CalibrationRow;

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
    "duration": 0.614,
    "message": "Found person",
    "count": 1,
    "code": 200,
    "command": "detect",
    "moduleId": "Lookdown",
    "inferenceMs": 581,
    "processMs": 614,
    "analysisRoundTripMs": 614
}))]
#[serde(rename_all = "camelCase")]
pub(in crate::api) struct DeepStackAnswer {
    /// Always true; failures have false.
    success: bool,
    /// Persons, highest confidence first.
    predictions: Vec<DeepStackPrediction>,
    /// Time from the arrival of the frame to its report, seconds.
    duration: f64,
    /// The result in words, of CodeProject.AI as the fields below.
    message: &'static str,
    /// The number of persons.
    count: usize,
    /// Always 200.
    code: u16,
    /// Always `detect`.
    command: &'static str,
    /// Always `Lookdown`.
    module_id: &'static str,
    /// Time of the inference, whole milliseconds.
    inference_ms: i64,
    /// Time from the arrival of the frame to its report, whole milliseconds.
    process_ms: i64,
    /// The same as `processMs`: no other process is involved.
    analysis_round_trip_ms: i64,
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
        let total_ms = whole(report.timings_ms.total.round());
        Self {
            success: true,
            predictions: report.persons.iter().map(Into::into).collect(),
            duration: report.timings_ms.total / MILLIS_PER_SECOND,
            message: match report.persons.len() {
                0 => "No objects found",
                _ => "Found person",
            },
            count: report.persons.len(),
            code: 200,
            command: "detect",
            module_id: "Lookdown",
            inference_ms: whole(report.timings_ms.inference.round()),
            process_ms: total_ms,
            analysis_round_trip_ms: total_ms,
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
    reason = "boxes lie within the frame, and times within deadlines"
)]
fn whole(number: f64) -> i64 {
    number as i64
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
