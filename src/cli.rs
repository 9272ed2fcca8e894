//! The command line.

mod annotate;
mod async_runtime;
mod calibration;
mod complete;
mod count;
mod detect;
mod eval;
mod health;
mod key;
mod model;
mod parameters;
mod progress;
mod run;
mod serve;
mod server_flags;
mod watch;

use std::{
    ffi::OsString,
    io::{self, Write},
    process::ExitCode,
};

use anyhow::Context;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

use self::{
    progress::{UNWRITABLE, is_closed_pipe, with_causes},
    server_flags::SettingsFile,
};
use crate::api;

/// Detects persons in the images of ceiling fisheye cameras.
#[derive(Debug, Parser)]
#[command(name = "lookdown", propagate_version = true)]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Watch cameras, count people and serve all of it, in one process
    Run(Box<run::Arguments>),
    /// Start the HTTP server alone
    Serve(serve::Arguments),
    /// Send frames of cameras to a server: snapshots, MJPEG, RTSP, folders, video files
    Watch(Box<watch::Arguments>),
    /// Count persons over time: tracks, lines, zones, sites, from the reports of a server
    Count(count::Arguments),
    /// Check that the server with these settings on this machine is ready: exits with 0 or 1
    Health(health::Arguments),
    /// Detect the persons in images: one JSON report per line on standard output
    Detect(Box<detect::Arguments>),
    /// Measure the quality of detections on a data set: average precision and speed
    Eval(Box<eval::Arguments>),
    /// Check, convert and fit calibrations
    #[command(subcommand)]
    Calibration(calibration::Command),
    /// Check, list and fetch person models
    #[command(subcommand)]
    Model(model::Command),
    /// Create API keys
    #[command(subcommand)]
    Key(key::Command),
    /// Print the OpenAPI document
    #[command(hide = true)]
    Openapi {
        /// Print that of the counts instead
        #[arg(long)]
        counts: bool,
    },
    /// Print shell completions
    Completions(complete::CompletionArguments),
    /// Write the manual pages
    Manual(complete::ManualArguments),
}

/// Runs a command line, whose first argument is the name of the program. `commit` is the commit
/// from which the binary was built, if it is known. Ends the process if the command line is
/// invalid.
pub fn run(arguments: impl IntoIterator<Item = OsString>, commit: Option<&str>) -> ExitCode {
    let arguments: Vec<_> = arguments.into_iter().collect();
    match complete::complete(&arguments, || command(commit)) {
        Ok(false) => {}
        Ok(true) => return ExitCode::SUCCESS,
        Err(error) => error.exit(),
    }
    let outcome = match parse(arguments, commit).command {
        Command::Run(arguments) => run::run(&arguments, commit),
        Command::Serve(arguments) => serve::run(&arguments, commit),
        Command::Watch(arguments) => watch::run(&arguments),
        Command::Count(arguments) => count::run(&arguments),
        Command::Health(arguments) => health::run(&arguments),
        Command::Detect(arguments) => detect::run(&arguments),
        Command::Eval(arguments) => eval::run(&arguments),
        Command::Calibration(command) => calibration::run(&command),
        Command::Model(command) => model::run(&command),
        Command::Key(command) => key::run(&command),
        Command::Openapi { counts } => print_openapi(counts),
        Command::Completions(arguments) => complete::print_completions(&arguments),
        Command::Manual(arguments) => complete::write_manual(&arguments, command(commit)),
    };
    match outcome {
        Ok(code) => code,
        Err(error) if is_closed_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            // Printed directly: the log may not be started, or may filter this out.
            eprintln!("lookdown: {}", with_causes(&error));
            ExitCode::FAILURE
        }
    }
}

/// Parses the command line. Ends the process with an explanation if it is invalid.
fn parse(arguments: impl IntoIterator<Item = OsString>, commit: Option<&str>) -> CommandLine {
    let matches = command(commit).get_matches_from(arguments);
    CommandLine::from_arg_matches(&matches).unwrap_or_else(|error| error.exit())
}

fn command(commit: Option<&str>) -> clap::Command {
    let version = env!("CARGO_PKG_VERSION");
    CommandLine::command().version(match commit {
        Some(commit) if !commit.is_empty() => format!("{version} (commit {commit})"),
        _ => version.to_owned(),
    })
}

fn print_openapi(of_counts: bool) -> anyhow::Result<ExitCode> {
    let document = if of_counts {
        lookdown_count::openapi_document().to_pretty_json()?
    } else {
        serde_json::to_string_pretty(&api::openapi_document(None)?)?
    };
    writeln!(io::stdout(), "{document}").context(UNWRITABLE)?;
    Ok(ExitCode::SUCCESS)
}
