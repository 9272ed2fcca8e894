//! The output files of calibrations.

use std::{
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
};

use anyhow::{Context, ensure};
use lookdown_calibration::{export::Target, native::NativeCalibration};

use crate::cli::output::UNWRITABLE;

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
