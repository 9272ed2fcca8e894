//! `lookdown calibration height`

use std::{path::PathBuf, process::ExitCode};

use anyhow::Context;
use clap::Args;

use super::{
    people::{PeopleSource, set_height},
    source::{Source, read_frames, write_native},
};
use crate::cli::server_flags::SettingsFile;

/// Arguments of `lookdown calibration height`.
#[derive(Debug, Args)]
pub(in super::super) struct Arguments {
    #[command(flatten)]
    source: Source,
    /// Frames of the camera with people who stand: JPEG, PNG or WebP, all of one size.
    /// They may be left out with --reports
    #[arg(required_unless_present = "reports", value_name = "FRAME")]
    frames: Vec<PathBuf>,
    /// A file of reports of `lookdown detect` with this calibration, one per line. May be repeated
    #[arg(long, value_name = "FILE.jsonl")]
    reports: Vec<PathBuf>,
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
    let frames = match arguments.frames.as_slice() {
        [] => Vec::new(),
        paths => read_frames(paths)?.1,
    };
    let people = PeopleSource {
        frames: &frames,
        reports: &arguments.reports,
        settings: &arguments.settings_file,
    };
    set_height(&mut native, &people).with_context(|| path.to_string())?;
    write_native(&native, arguments.out.as_deref())?;
    Ok(ExitCode::SUCCESS)
}
