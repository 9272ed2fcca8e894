//! `lookdown calibration height`

use std::{path::PathBuf, process::ExitCode};

use anyhow::Context;
use clap::Args;

use super::{
    frame_file::read_frames, native_output::write_native, people::set_height, source::Source,
};
use crate::cli::settings_file::SettingsFile;

/// Arguments of `lookdown calibration height`.
#[derive(Debug, Args)]
pub(in super::super) struct Arguments {
    #[command(flatten)]
    source: Source,
    /// Frames of the camera with people who stand: JPEG, PNG or WebP, all of one size
    #[arg(required = true, value_name = "FRAME")]
    frames: Vec<PathBuf>,
    /// Output file [default: standard output]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    settings_file: SettingsFile,
}

/// Writes the calibration with the height of the camera.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let path = arguments.source.file.display();
    let (mut native, _) = arguments.source.read_native(None)?;
    let (_, frames) = read_frames(&arguments.frames)?;
    set_height(&mut native, &frames, &arguments.settings_file).with_context(|| path.to_string())?;
    write_native(&native, arguments.out.as_deref())?;
    Ok(ExitCode::SUCCESS)
}
