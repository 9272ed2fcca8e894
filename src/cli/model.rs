//! `lookdown model`

mod check;
mod description;
mod fetch;
mod manifest;
mod sample;
mod tune;

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
    /// Fetch, verify and install the weights of a model of the repository
    Fetch(fetch::Arguments),
    /// Measure the constants of the profiles that fit a model, and write them into its model.toml
    Tune(tune::Arguments),
}

/// Runs the subcommand.
pub(super) fn run(command: &Command) -> anyhow::Result<ExitCode> {
    match command {
        Command::Check(arguments) => check::run(arguments),
        Command::List(settings_file) => fetch::list(settings_file),
        Command::Fetch(arguments) => fetch::run(arguments),
        Command::Tune(arguments) => tune::run(arguments),
    }
}
