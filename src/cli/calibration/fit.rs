//! `lookdown calibration fit`

mod arguments;
mod circle;
mod existing;
mod room;

use std::process::ExitCode;

use anyhow::Context;

use super::{
    people::{PeopleSource, set_height},
    read_frames,
    source::{refuse_input, write_native},
};
use crate::room_calibration::give_height;

pub(in crate::cli) use arguments::Arguments;

/// Fits the camera, writes the calibration, and describes the accuracy on standard error.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    for (option, out) in [("--out", &arguments.out), ("--preview", &arguments.preview)] {
        refuse_input(option, out.as_deref(), &arguments.frames)?;
    }
    let existing = existing::existing(arguments)?;
    let (image, frames) = read_frames(&arguments.frames)?;
    let mut calibration = if arguments.circle_only {
        circle::fit(arguments, image, &frames)?
    } else {
        room::fit(arguments, image, &frames)?
    };
    if let Some(existing) = existing {
        calibration = existing::put_into(existing, calibration)?;
    }
    if let Some(height) = arguments.height {
        give_height(&mut calibration, height);
    }
    let mut height = Ok(());
    if arguments.people {
        let people = PeopleSource {
            frames: &frames,
            reports: &[],
            settings: &arguments.settings_file,
        };
        height = set_height(&mut calibration, &people);
    }
    write_native(&calibration, arguments.out.as_deref())?;
    height.context("the calibration is written without a new height")?;
    Ok(ExitCode::SUCCESS)
}
