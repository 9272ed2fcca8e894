//! Arguments of `lookdown calibration fit`.

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use lookdown_calibration::CalibrationId;
use lookdown_lens::self_calibration::{FieldOfView, IdealLens, KnownCamera};

use crate::{
    cli::{parameters::one_of, settings_file::SettingsFile},
    room_calibration::known::known_height,
};

/// Arguments of `lookdown calibration fit`.
#[derive(Debug, Args)]
#[expect(clippy::struct_excessive_bools, reason = "independent flags")]
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
    /// Projection of the lens, from its data sheet. Cameras that look straight down need it
    /// [default: found; equidistant with --circle-only]
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
    /// Output file. Zones, masks, defaults and the height of a calibration there are kept [default:
    /// standard output]
    #[arg(long, value_name = "FILE")]
    pub(super) out: Option<PathBuf>,
    /// Replace the lens and level of the calibration in the output file, though they were measured
    /// or given
    #[arg(long, requires = "out")]
    pub(super) replace: bool,
    /// Output file of the preview, JPEG: straightened views before and after the fit, and the edges
    /// of the room
    #[arg(long, value_name = "OUT.jpg", conflicts_with = "circle_only")]
    pub(super) preview: Option<PathBuf>,
    #[command(flatten)]
    pub(super) settings_file: SettingsFile,
}

impl Arguments {
    /// Returns what the user knows of the camera.
    pub(super) fn known(&self) -> KnownCamera {
        KnownCamera {
            lens: self.lens,
            field_of_view: self.field_of_view,
            is_on_ceiling: self.ceiling,
        }
    }
}

fn height(text: &str) -> anyhow::Result<f64> {
    known_height(text.parse().context("give meters, such as 2.8")?)
}
