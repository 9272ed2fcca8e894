//! The data set and the interpretation of its ground truth.

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use lookdown_eval::{DataSet, Scoring};

use crate::{cli::parameters::named_calibration, settings::Settings};

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
    pub(in crate::cli) fn open(&self, settings: &Settings) -> anyhow::Result<DataSet> {
        let mut data_set = DataSet::open(&self.data_set)?;
        if let Some(named) = &self.calibration {
            data_set = data_set.with_calibration(&named_calibration(named, settings)?);
        }
        if self.axis_parallel {
            data_set = data_set
                .scored_as(Scoring::AxisParallel)
                .context("--axis-parallel")?;
        }
        Ok(data_set)
    }
}
