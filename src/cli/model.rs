//! `lookdown model`

mod check;
mod list;

use std::process::ExitCode;

use clap::Subcommand;

use super::SettingsFile;

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
        Command::List(settings_file) => list::run(settings_file),
    }
}
