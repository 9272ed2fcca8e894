//! Frames from image files.
//!
//! The output files of calibrations.

use std::{
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
};

use anyhow::{Context, bail, ensure};
use lookdown_calibration::{
    export::Target,
    native::{NativeCalibration, NativeImage},
};
use lookdown_common::files::{self, MAX_IMAGE_BYTES};
use lookdown_imaging::{
    Frame,
    decode::{DecodeLimits, decode},
};

use crate::cli::output::UNWRITABLE;

/// Decodes a frame from an image file.
pub(super) fn read_frame(path: &Path) -> anyhow::Result<Frame> {
    let encoded = files::read(path, MAX_IMAGE_BYTES).context("the file cannot be read")?;
    Ok(decode(&encoded, &DecodeLimits::default())?.frame)
}

/// Reads the frames of one camera, which must have one size.
pub(super) fn read_frames(paths: &[PathBuf]) -> anyhow::Result<(NativeImage, Vec<Frame>)> {
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

/// Refuses an output file that is one of the frames.
pub(super) fn refuse_input(
    option: &str,
    out: Option<&Path>,
    frames: &[PathBuf],
) -> anyhow::Result<()> {
    let real = |path: &Path| path.canonicalize().ok();
    let Some(written) = out.and_then(real) else {
        return Ok(());
    };
    let is_frame = frames
        .iter()
        .any(|frame| real(frame).as_ref() == Some(&written));
    ensure!(
        !is_frame,
        "{option}: {} is a frame: name another file",
        written.display()
    );
    Ok(())
}

/// Writes a calibration into the file of `--out`, by default to standard output.
pub(super) fn write_native(
    calibration: &NativeCalibration,
    out: Option<&Path>,
) -> anyhow::Result<()> {
    write_content(&Target::Native.write(calibration)?.content, out)
}

/// Writes the content of a calibration file into the file of `--out`, by default to standard
/// output.
pub(super) fn write_content(content: &str, out: Option<&Path>) -> anyhow::Result<()> {
    match out {
        Some(out) => fs::write(out, content)
            .with_context(|| format!("--out: {} cannot be written", out.display())),
        None => write!(io::stdout(), "{content}").context(UNWRITABLE),
    }
}
