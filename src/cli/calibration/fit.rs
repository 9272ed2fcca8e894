//! `lookdown calibration fit`

mod circle;
mod preview;
mod room;

use std::{
    fs,
    io::{self, Write},
    path::PathBuf,
    process::ExitCode,
};

use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use lookdown_detect::imaging::Frame;
use lookdown_lens::{
    calibration::{CalibrationId, export::Target, native::NativeImage},
    geometry::lens::{Equidistant, Equisolid, LensModel, Orthographic, Stereographic},
};

use super::read_frame;
use crate::cli::output::UNWRITABLE;

/// Arguments of `lookdown calibration fit`.
#[derive(Debug, Args)]
pub(in super::super) struct Arguments {
    /// Frames of one camera: JPEG, PNG or WebP, all of one size. Bright frames work best
    #[arg(required = true, value_name = "FRAME")]
    frames: Vec<PathBuf>,
    /// ID of the calibration
    #[arg(long, value_name = "ID", default_value = "camera")]
    id: CalibrationId,
    /// Detect the lens circle only; lens, field of view and level are given or assumed
    #[arg(long)]
    circle_only: bool,
    /// Projection of the lens, from its data sheet [default: found; equidistant with --circle-only]
    #[arg(long, value_name = "MODEL")]
    lens: Option<IdealLens>,
    /// Field of view of the circle in degrees, from the data sheet [default: found; 180 with
    /// --circle-only]
    #[arg(long, value_name = "DEGREES", value_parser = field_of_view)]
    field_of_view: Option<f64>,
    /// Height of the camera above the floor: enables floor positions of persons
    #[arg(long, value_name = "METRES", value_parser = height)]
    height: Option<f64>,
    /// Output file [default: standard output]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Output file of straightened views before and after the fit, JPEG
    #[arg(long, value_name = "OUT.jpg", conflicts_with = "circle_only")]
    preview: Option<PathBuf>,
}

/// Lenses with one parameter, the focal length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum IdealLens {
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
    fn k1(self) -> f64 {
        match self {
            Self::Equidistant => 0.0,
            Self::Equisolid => -1.0 / 24.0,
            Self::Stereographic => 1.0 / 12.0,
            Self::Orthographic => -1.0 / 6.0,
        }
    }

    fn with(self, focal: f64, cx: f64, cy: f64, max_theta: f64) -> LensModel {
        match self {
            Self::Equidistant => Equidistant::with_focal(focal, cx, cy, max_theta).into(),
            Self::Equisolid => Equisolid::with_focal(focal, cx, cy, max_theta).into(),
            Self::Stereographic => Stereographic::with_focal(focal, cx, cy, max_theta).into(),
            Self::Orthographic => Orthographic::with_focal(focal, cx, cy, max_theta).into(),
        }
    }
}

/// Fits the camera, writes the calibration, and describes the accuracy on standard error.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let (image, frames) = read(&arguments.frames)?;
    let calibration = if arguments.circle_only {
        circle::fit(arguments, image, &frames)?
    } else {
        room::fit(arguments, image, &frames)?
    };
    let written = Target::Native.write(&calibration)?.content;
    match &arguments.out {
        Some(out) => fs::write(out, written)
            .with_context(|| format!("--out: {} cannot be written", out.display()))?,
        None => write!(io::stdout(), "{written}").context(UNWRITABLE)?,
    }
    Ok(ExitCode::SUCCESS)
}

/// Reads the frames, which must have one size.
fn read(paths: &[PathBuf]) -> anyhow::Result<(NativeImage, Vec<Frame>)> {
    let mut frames: Vec<Frame> = Vec::with_capacity(paths.len());
    for path in paths {
        let frame = read_frame(path).with_context(|| path.display().to_string())?;
        if let Some(first) = frames.first()
            && (frame.width(), frame.height()) != (first.width(), first.height())
        {
            bail!(
                "{}: {}x{} pixels, but the first frame has {}x{}: give frames of one camera at one \
                 size",
                path.display(),
                frame.width(),
                frame.height(),
                first.width(),
                first.height()
            );
        }
        frames.push(frame);
    }
    let first = frames.first().context("give at least one frame")?;
    let (width, height) = (first.width(), first.height());
    Ok((NativeImage { width, height }, frames))
}

/// Rounds to thousandths, enough for pixels.
fn thousandths(pixels: f64) -> f64 {
    (pixels * 1000.0).round() / 1000.0
}

fn field_of_view(text: &str) -> Result<f64, &'static str> {
    let degrees = text.parse().ok();
    degrees
        .filter(|degrees| (60.0..=300.0).contains(degrees))
        .ok_or("give 60 to 300 degrees")
}

fn height(text: &str) -> Result<f64, &'static str> {
    let metres = text.parse().ok();
    metres
        .filter(|metres| *metres > 0.0 && *metres <= 100.0)
        .ok_or("give metres above 0, at most 100")
}
