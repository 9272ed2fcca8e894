//! Arguments of `lookdown calibration fit`.

use std::path::PathBuf;

use clap::Args;
use lookdown_lens::{
    calibration::CalibrationId,
    self_calibration::{FieldOfView, IdealLens},
};

use crate::cli::{parameters::one_of, settings_file::SettingsFile};

/// Arguments of `lookdown calibration fit`.
#[derive(Debug, Args)]
pub(in crate::cli) struct Arguments {
    /// Frames of one camera: JPEG, PNG or WebP, all of one size. Bright frames work best
    #[arg(required = true, value_name = "FRAME")]
    pub(super) frames: Vec<PathBuf>,
    /// ID of the calibration
    #[arg(long, value_name = "ID", default_value = "camera")]
    pub(super) id: CalibrationId,
    /// Detect the lens circle only; lens, field of view and level are given or assumed
    #[arg(long)]
    pub(super) circle_only: bool,
    /// Projection of the lens, from its data sheet. Most ceiling cameras are equidistant [default:
    /// found; equidistant with --circle-only]
    #[arg(long, value_name = "MODEL", value_parser = one_of::<IdealLens>())]
    pub(super) lens: Option<IdealLens>,
    /// Field of view of the circle in degrees, from the data sheet [default: found; 180 with
    /// --circle-only]
    #[arg(long, value_name = "DEGREES")]
    pub(super) field_of_view: Option<FieldOfView>,
    /// The camera is on a ceiling, even if one wall fills the image
    #[arg(long, conflicts_with = "circle_only")]
    pub(super) ceiling: bool,
    /// Height of the camera above the floor: enables floor positions of persons
    #[arg(long, value_name = "METERS", value_parser = height)]
    pub(super) height: Option<f64>,
    /// Find the height of the camera from the people in the frames
    #[arg(long, conflicts_with = "height")]
    pub(super) people: bool,
    /// Output file [default: standard output]
    #[arg(long, value_name = "FILE")]
    pub(super) out: Option<PathBuf>,
    /// Output file of the preview, JPEG: straightened views before and after the fit, and the edges
    /// of the room
    #[arg(long, value_name = "OUT.jpg", conflicts_with = "circle_only")]
    pub(super) preview: Option<PathBuf>,
    #[command(flatten)]
    pub(super) settings_file: SettingsFile,
}

fn height(text: &str) -> Result<f64, &'static str> {
    let meters = text.parse().ok();
    meters
        .filter(|meters| *meters > 0.0 && *meters <= 100.0)
        .ok_or("give meters above 0, at most 100")
}
