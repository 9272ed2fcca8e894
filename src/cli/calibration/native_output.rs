//! The output of a native calibration.

use std::{
    fs,
    io::{self, Write},
    path::Path,
};

use anyhow::Context;
use lookdown_lens::calibration::{export::Target, native::NativeCalibration};

use crate::cli::output::UNWRITABLE;

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
