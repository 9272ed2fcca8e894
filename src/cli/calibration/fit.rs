//! `lookdown calibration fit`

mod arguments;
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
use lookdown_detect::imaging::Frame;
use lookdown_lens::calibration::{export::Target, native::NativeImage};

use super::read_frame;
use crate::cli::output::UNWRITABLE;

pub(in crate::cli) use arguments::Arguments;

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
