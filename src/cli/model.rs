//! `lookdown model`

mod check;

use std::{
    io::{self, Write},
    path::Path,
    process::ExitCode,
};

use anyhow::Context;
use clap::Subcommand;
use lookdown_detect::inference::{ModelManifest, model_names};

use super::{progress::UNWRITABLE, server_flags::SettingsFile};
use crate::settings::explain;

/// The subcommands for models.
#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Show the properties of a model, run it on a sample and draw the detections
    Check(check::Arguments),
    /// List the models of the repository: name, size of the weights or `missing`, license
    List(SettingsFile),
}

/// Runs the subcommand.
pub(super) fn run(command: &Command) -> anyhow::Result<ExitCode> {
    match command {
        Command::Check(arguments) => check::run(arguments),
        Command::List(settings_file) => list(settings_file),
    }
}

/// Bytes of the unit of sizes.
const MEBIBYTE: f64 = 1_048_576.0;

/// Lists the models of the repository.
fn list(settings_file: &SettingsFile) -> anyhow::Result<ExitCode> {
    let settings = settings_file.load()?;
    let folder = settings.model.find_repository()?;
    let mut out = io::stdout().lock();
    for name in model_names(&folder) {
        let manifest = ModelManifest::locate(&folder.join(&name));
        let line = match &manifest {
            Ok(manifest) => {
                let license = manifest.license.as_deref().unwrap_or("-");
                let size = size(&manifest.onnx);
                let size = size.as_deref().unwrap_or("missing");
                format!("{size:>10}  {license}")
            }
            Err(error) => format!("{:>10}  {}", "invalid", explain(error)),
        };
        writeln!(out, "{name:<40}{line}").context(UNWRITABLE)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The size of a file. `None` if it is missing.
fn size(file: &Path) -> Option<String> {
    let mebibytes = |bytes: u64| bytes as f64 / MEBIBYTE;
    let metadata = file.metadata().ok()?;
    Some(format!("{:.1} MiB", mebibytes(metadata.len())))
}
