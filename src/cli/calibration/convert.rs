//! `lookdown calibration convert`

use std::{path::PathBuf, process::ExitCode};

use anyhow::Context;
use clap::Args;
use lookdown_calibration::export::Target;

use super::source::Source;
use crate::cli::{parameters::one_of, progress::write_or_print};

/// Arguments of `lookdown calibration convert`.
#[derive(Debug, Args)]
pub(in super::super) struct Arguments {
    #[command(flatten)]
    source: Source,
    /// The format to write
    #[arg(long, value_name = "FORMAT", default_value = "native", value_parser = one_of::<Target>())]
    to: Target,
    /// The ID to write into a native file [default: the file's name, with the camera's]
    #[arg(long, value_name = "ID")]
    id: Option<String>,
    /// Output file [default: standard output]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Writes one camera. Properties that the target format does not support are listed on standard
/// error.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let path = arguments.source.file.display();
    let id = arguments.id.as_deref().map(str::parse).transpose();
    let (native, notes) = arguments.source.read_native(id.context("--id")?.as_ref())?;
    let exported = arguments.to.write(&native)?;
    let notes = notes.iter().map(ToString::to_string);
    for note in notes.chain(exported.lost) {
        eprintln!("lookdown: {path}: {note}");
    }
    write_or_print("--out", arguments.out.as_deref(), &exported.content)?;
    Ok(ExitCode::SUCCESS)
}
