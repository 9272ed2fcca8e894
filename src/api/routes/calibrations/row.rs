//! A calibration in the list of calibrations.

use lookdown_calibration::AreaShare;
use lookdown_common::report::ReportWarning;
use serde::Serialize;
use utoipa::ToSchema;

use crate::{
    api::detect::report::to_warning,
    calibration_store::{CalibrationEntry, CalibrationRow},
};

/// A calibration.
#[derive(Serialize, ToSchema)]
#[schema(example = json!({
    "id": "lobby", "revision": "6b2a0c51f7d3", "file": "lobby.json",
    "image": { "width": 1680, "height": 1680 }, "lens": "equidistant"
}))]
pub(in crate::api) struct CalibrationInfo {
    /// The ID of the calibration.
    id: String,
    /// The revision in use, as in reports; absent when no revision is in use.
    #[serde(skip_serializing_if = "Option::is_none")]
    revision: Option<String>,
    /// The name of the file.
    file: String,
    /// The size of the frames that the calibration was made for.
    #[serde(skip_serializing_if = "Option::is_none")]
    image: Option<ImageSize>,
    /// The lens model.
    #[serde(skip_serializing_if = "Option::is_none")]
    lens: Option<&'static str>,
    /// The reason why the newest version of the file is not used.
    #[serde(skip_serializing_if = "Option::is_none")]
    problem: Option<String>,
    /// The shares of the frame that zones, masks, areas and ignored places in the frame cover.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    coverage: Vec<Coverage>,
    /// Assumptions made when the file was read, and implausible properties.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    warnings: Vec<ReportWarning>,
}

/// The share of the frame that an area covers.
#[derive(Serialize, ToSchema)]
pub(in crate::api) struct Coverage {
    /// The field of the area, such as `masks[0]`.
    field: String,
    /// The share, percent.
    percent: f64,
}

/// A frame size.
#[derive(Serialize, ToSchema)]
pub(in crate::api) struct ImageSize {
    /// Pixels.
    width: u32,
    /// Pixels.
    height: u32,
}

impl From<&CalibrationEntry> for CalibrationInfo {
    fn from(entry: &CalibrationEntry) -> Self {
        let calibration = &entry.calibration;
        let (width, height) = calibration.image_size();
        let mut warnings: Vec<_> = entry.notes.iter().map(to_warning).collect();
        warnings.extend(calibration.warnings().iter().map(to_warning));
        let shares = calibration.areas().shares(width, height).into_iter();
        let coverage = shares.map(|AreaShare { field, percent }| Coverage {
            field,
            percent: (percent * 1000.0).round() / 1000.0,
        });
        Self {
            id: calibration.id().to_string(),
            revision: Some(calibration.revision().to_owned()),
            file: entry.file.clone(),
            image: Some(ImageSize { width, height }),
            lens: Some(calibration.lens().model()),
            problem: None,
            coverage: coverage.collect(),
            warnings,
        }
    }
}

impl From<CalibrationRow> for CalibrationInfo {
    fn from(row: CalibrationRow) -> Self {
        let known = row.entry.as_deref().map(Self::from);
        Self {
            problem: row.problem,
            ..known.unwrap_or(Self {
                id: row.id.to_string(),
                revision: None,
                file: row.file,
                image: None,
                lens: None,
                problem: None,
                coverage: Vec::new(),
                warnings: Vec::new(),
            })
        }
    }
}
