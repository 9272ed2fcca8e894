//! `lookdown calibration fit`
//!
//! The calibration that is in the output file already: what a fit keeps of it, and what it may not
//! replace.

mod arguments;
mod circle;
mod room;

use std::process::ExitCode;

use anyhow::{Context, bail};
use lookdown_calibration::{
    formats::Format,
    native::{NativeCalibration, NativeImage, NativeMount, SourcedValue, ValueSource},
};

use super::{
    people::{PeopleSource, set_height},
    read_frames,
    source::{Source, refuse_input, write_native},
};
use crate::room_calibration::give_height;

pub(in crate::cli) use arguments::Arguments;

/// Fits the camera, writes the calibration, and describes the accuracy on standard error.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    for (option, out) in [("--out", &arguments.out), ("--preview", &arguments.preview)] {
        refuse_input(option, out.as_deref(), &arguments.frames)?;
    }
    let existing = existing(arguments)?;
    let (image, frames) = read_frames(&arguments.frames)?;
    let mut calibration = if arguments.circle_only {
        circle::fit(arguments, image, &frames)?
    } else {
        room::fit(arguments, image, &frames)?
    };
    if let Some(existing) = existing {
        calibration = put_into(existing, calibration)?;
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

/// The values that a fit finds.
const FOUND: [SourcedValue; 3] = [
    SourcedValue::Lens,
    SourcedValue::Center,
    SourcedValue::WorldUp,
];

/// Reads the calibration in the output file, if there is one.
///
/// # Errors
/// A file that is not a native calibration, and values that may not be replaced.
fn existing(arguments: &Arguments) -> anyhow::Result<Option<NativeCalibration>> {
    let Some(out) = arguments.out.as_ref().filter(|out| out.is_file()) else {
        return Ok(None);
    };
    let path = out.display();
    let source = Source::new(out.clone());
    let native = source.read_one().and_then(|(format, _)| {
        let (native, _) = source.read_native(None)?;
        if format != Format::Native {
            bail!("the file is not in the native format");
        }
        Ok(native)
    });
    let native = native.with_context(|| format!("--out: {path} exists: name another file"))?;
    let kept: Vec<_> = FOUND
        .iter()
        .filter_map(|value| source_to_keep(&native, *value))
        .collect();
    if !kept.is_empty() && !arguments.replace {
        bail!(
            "--out: {path} has a camera already ({}): name another file, or add --replace to \
             replace lens, center and level; zones, masks, defaults and the height stay",
            kept.join(", ")
        );
    }
    Ok(Some(native))
}

/// The source of a value that is more than an assumption, as text.
fn source_to_keep(native: &NativeCalibration, value: SourcedValue) -> Option<String> {
    match native.sources.get(&value) {
        Some(source) if source.source == ValueSource::Assumed => None,
        Some(source) => Some(format!("{value} {}", source.source)),
        None => Some(format!("{value} of unknown source")),
    }
}

/// Puts the camera that was found into the calibration of the same frames.
///
/// # Errors
/// Frames of another size than that of the calibration.
fn put_into(
    existing: NativeCalibration,
    found: NativeCalibration,
) -> anyhow::Result<NativeCalibration> {
    let NativeImage { width, height } = existing.image;
    if existing.image != found.image {
        bail!(
            "--out: the calibration is of frames of {width}×{height} pixels, and the frames have \
             {}×{}: give frames of that size, or name another file",
            found.image.width,
            found.image.height
        );
    }
    let mut sources = found.sources;
    let others = existing.sources.iter();
    let others = others.filter(|(value, _)| !value.is_of_lens_or_level());
    sources.extend(others.map(|(value, source)| (*value, *source)));
    Ok(NativeCalibration {
        id: found.id,
        lens: found.lens,
        mount: NativeMount {
            world_up: found.mount.world_up,
            ..existing.mount
        },
        sources,
        ..existing
    })
}
