//! The arguments of `lookdown eval`.
//!
//! The data set and the interpretation of its ground truth.

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use lookdown_detect::{detection::Refinement, parameters::Profile};
use lookdown_eval::{DataSet, Scoring, Stratification};

use crate::{
    cli::{
        parameters::{named_calibration, one_of},
        settings_file::SettingsFile,
    },
    settings::Settings,
};

/// C_t without `--score-threshold`: low, as average precision considers all scores.
pub(in crate::cli) const DEFAULT_SCORE_THRESHOLD: &str = "0.001";

/// Arguments of `lookdown eval`.
#[derive(Debug, Args)]
pub(in crate::cli) struct Arguments {
    #[command(flatten)]
    pub(super) truth: TruthFlags,
    /// Also score the persons of each stratum: by distance from the optical axis, size or
    /// visibility; may be repeated
    #[arg(long, value_name = "NAME", value_parser = one_of::<Stratification>())]
    pub(super) by: Vec<Stratification>,
    /// Trade-off between accuracy and cost; may be repeated [default: balanced]
    #[arg(long, value_name = "NAME", value_parser = one_of::<Profile>())]
    pub(super) profile: Vec<Profile>,
    /// Method that merges overlapping boxes into persons; may be repeated [default: all of them]
    #[arg(long, value_name = "NAME", value_parser = one_of::<Refinement>())]
    pub(super) refine: Vec<Refinement>,
    /// The rows of the paper's table: its three refinements, and the detector without views
    #[arg(long, conflicts_with_all = ["profile", "refine"])]
    pub(super) paper: bool,
    /// Model [default: the profile's]
    #[arg(long, value_name = "NAME")]
    pub(super) model: Option<String>,
    /// Ignore persons with a lower score, 0 to 1
    #[arg(long, value_name = "SCORE", default_value = DEFAULT_SCORE_THRESHOLD)]
    pub(super) score_threshold: String,
    /// Boxes that overlap at least this much are the same person [default: the refinement's]
    #[arg(long, value_name = "IOU")]
    pub(super) iou_threshold: Option<String>,
    /// Width of Gaussian Soft-NMS [default: 0.3]
    #[arg(long, value_name = "NUMBER")]
    pub(super) sigma: Option<String>,
    /// Turn the views of the profile about the vertical by this angle, degrees: the mean of
    /// several turns depends less on where people happen to be in the views
    #[arg(
        long,
        value_name = "DEGREES",
        default_value_t = 0,
        value_parser = clap::value_parser!(u16).range(..360)
    )]
    pub(super) turn_deg: u16,
    /// Print one JSON object per row instead of a table
    #[arg(long)]
    pub(super) json: bool,
    /// Also write the detections as COCO results: a file per row, named
    /// PROFILE.REFINEMENT.MODEL.json
    #[arg(long, value_name = "FOLDER")]
    pub(super) save_detections: Option<PathBuf>,
    /// Score these COCO results instead of running a model: a file, or all .json files of a folder;
    /// may be repeated
    #[arg(
        long,
        value_name = "FILE|FOLDER",
        conflicts_with_all = ["profile", "refine", "paper", "model", "score_threshold",
                              "iou_threshold", "sigma", "save_detections", "turn_deg"]
    )]
    pub(super) from_detections: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) settings_file: SettingsFile,
}

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
