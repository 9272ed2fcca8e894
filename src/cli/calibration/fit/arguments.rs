//! Arguments of `lookdown calibration fit`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use lookdown_lens::{
    calibration::CalibrationId,
    geometry::lens::{Equidistant, Equisolid, LensModel, Orthographic, Stereographic},
};

use crate::cli::settings_file::SettingsFile;

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
    /// Projection of the lens, from its data sheet [default: found; equidistant with --circle-only]
    #[arg(long, value_name = "MODEL")]
    pub(super) lens: Option<IdealLens>,
    /// Field of view of the circle in degrees, from the data sheet [default: found; 180 with
    /// --circle-only]
    #[arg(long, value_name = "DEGREES", value_parser = field_of_view)]
    pub(super) field_of_view: Option<f64>,
    /// Height of the camera above the floor: enables floor positions of persons
    #[arg(long, value_name = "METERS", value_parser = height)]
    pub(super) height: Option<f64>,
    /// Find the height of the camera from the people in the frames
    #[arg(long, conflicts_with = "height")]
    pub(super) people: bool,
    /// Output file [default: standard output]
    #[arg(long, value_name = "FILE")]
    pub(super) out: Option<PathBuf>,
    /// Output file of straightened views before and after the fit, JPEG
    #[arg(long, value_name = "OUT.jpg", conflicts_with = "circle_only")]
    pub(super) preview: Option<PathBuf>,
    #[command(flatten)]
    pub(super) settings_file: SettingsFile,
}

/// Lenses with one parameter, the focal length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum IdealLens {
    /// `r = f theta`: most ceiling cameras
    Equidistant,
    /// `r = 2 f sin(theta / 2)`
    Equisolid,
    /// `r = 2 f tan(theta / 2)`
    Stereographic,
    /// `r = f sin(theta)`
    Orthographic,
}

impl IdealLens {
    /// First coefficient of its odd polynomial.
    pub(super) fn k1(self) -> f64 {
        match self {
            Self::Equidistant => 0.0,
            Self::Equisolid => -1.0 / 24.0,
            Self::Stereographic => 1.0 / 12.0,
            Self::Orthographic => -1.0 / 6.0,
        }
    }

    /// Returns the lens with this focal length and center in pixels, up to an angle in radians.
    pub(super) fn with(self, focal: f64, cx: f64, cy: f64, max_theta: f64) -> LensModel {
        match self {
            Self::Equidistant => Equidistant::with_focal(focal, cx, cy, max_theta).into(),
            Self::Equisolid => Equisolid::with_focal(focal, cx, cy, max_theta).into(),
            Self::Stereographic => Stereographic::with_focal(focal, cx, cy, max_theta).into(),
            Self::Orthographic => Orthographic::with_focal(focal, cx, cy, max_theta).into(),
        }
    }
}

/// Rounds to thousandths, enough for pixels.
pub(super) fn thousandths(pixels: f64) -> f64 {
    (pixels * 1000.0).round() / 1000.0
}

fn field_of_view(text: &str) -> Result<f64, &'static str> {
    let degrees = text.parse().ok();
    degrees
        .filter(|degrees| (60.0..=300.0).contains(degrees))
        .ok_or("give 60 to 300 degrees")
}

fn height(text: &str) -> Result<f64, &'static str> {
    let meters = text.parse().ok();
    meters
        .filter(|meters| *meters > 0.0 && *meters <= 100.0)
        .ok_or("give meters above 0, at most 100")
}
