//! `lookdown calibration fit`

mod arguments;
mod circle;
mod existing;
mod room;

use std::process::ExitCode;

use super::{
    native_output::write_native,
    people::{PeopleSource, set_height},
    read_frames,
};
use crate::room_calibration::give_height;

pub(in crate::cli) use arguments::Arguments;

/// Fits the camera, writes the calibration, and describes the accuracy on standard error.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
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
    if arguments.people {
        let people = PeopleSource {
            frames: &frames,
            reports: &[],
            settings: &arguments.settings_file,
        };
        set_height(&mut calibration, &people)?;
    }
    write_native(&calibration, arguments.out.as_deref())?;
    Ok(ExitCode::SUCCESS)
}
