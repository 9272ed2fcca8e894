//! The data set and the interpretation of its ground truth.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::Context;
use clap::Args;
use lookdown_calibration::{Calibration, CalibrationId};
use lookdown_detect::pipeline::CalibrationLookup;
use lookdown_eval::{DataSet, Scoring};

use crate::{app::open_calibrations, cli::SettingsFile};

/// The flags that select a data set.
#[derive(Debug, Args)]
pub(in crate::cli) struct TruthFlags {
    /// Images with annotated persons: a folder with annotations.json (COCO with a `calibration` per
    /// image), images/ and calibrations/; a COCO or CEPDOF file or a folder of them; a folder with
    /// Pascal VOC XML files; a PIROPO folder with head points
    pub(super) data_set: PathBuf,
    /// A calibration file, or the ID of one in the calibration folder, for every image [default:
    /// each image's own; without one an ideal lens is assumed]
    #[arg(long, value_name = "FILE|ID")]
    calibration: Option<String>,
    /// Score rotated ground truth by the bounds of the inscribed ellipses, with axis-parallel
    /// detections
    #[arg(long)]
    axis_parallel: bool,
}

impl TruthFlags {
    /// Opens the data set.
    pub(in crate::cli) fn open(&self, settings_file: &SettingsFile) -> anyhow::Result<DataSet> {
        let mut data_set = DataSet::open(&self.data_set)?;
        if let Some(named) = &self.calibration {
            data_set = data_set.with_calibration(&calibration(named, settings_file)?);
        }
        if self.axis_parallel {
            data_set = data_set
                .scored_as(Scoring::AxisParallel)
                .context("--axis-parallel")?;
        }
        Ok(data_set)
    }
}

fn calibration(named: &str, settings_file: &SettingsFile) -> anyhow::Result<Arc<Calibration>> {
    let path = Path::new(named);
    if path.is_file() {
        return Ok(Arc::new(Calibration::read(path)?));
    }
    let strange = || format!("--calibration: {named:?} is neither a file nor a calibration's ID");
    let id: CalibrationId = named.parse().with_context(strange)?;
    let calibrations = open_calibrations(&settings_file.load()?)?;
    calibrations.get(&id)?.with_context(strange)
}
