//! `lookdown calibration`

mod check;
mod convert;
mod fit;
mod height;
mod people;
mod place;
mod source;
mod suggest_area;

use std::process::ExitCode;

use clap::Subcommand;

use self::source::{read_frame, read_frames};

/// The subcommands for calibrations.
#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Show the content of a calibration file of any format, and draw it into a frame
    Check(check::Arguments),
    /// Write a calibration in the native format, or in that of another program
    Convert(convert::Arguments),
    /// Fit a calibration to frames of the room: lens, center and level from its straight edges
    Fit(fit::Arguments),
    /// Find the height of a camera from the people in its frames or reports
    Height(height::Arguments),
    /// Find the place of a camera on the floor of another, from people who walk through both views
    Place(place::Arguments),
    /// Suggest an area from the places where people walked
    SuggestArea(suggest_area::Arguments),
}

/// Runs the subcommand.
pub(super) fn run(command: &Command) -> anyhow::Result<ExitCode> {
    match command {
        Command::Check(arguments) => check::run(arguments),
        Command::Convert(arguments) => convert::run(arguments),
        Command::Fit(arguments) => fit::run(arguments),
        Command::Height(arguments) => height::run(arguments),
        Command::Place(arguments) => place::run(arguments),
        Command::SuggestArea(arguments) => suggest_area::run(arguments),
    }
}
