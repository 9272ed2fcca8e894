//! `lookdown calibration fit`

mod arguments;
mod circle;
mod room;

use std::process::ExitCode;

use super::{
    native_output::write_native,
    people::{PeopleSource, set_height},
    read_frames,
};

pub(in crate::cli) use arguments::Arguments;

/// Fits the camera, writes the calibration, and describes the accuracy on standard error.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let (image, frames) = read_frames(&arguments.frames)?;
    let mut calibration = if arguments.circle_only {
        circle::fit(arguments, image, &frames)?
    } else {
        room::fit(arguments, image, &frames)?
    };
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
