//! The calibration that is in the output file already: what a fit keeps of it, and what it may not
//! replace.

use anyhow::{Context, bail};
use lookdown_calibration::{
    formats::Format,
    native::{NativeCalibration, NativeImage, NativeMount, SourcedValue, ValueSource},
};

use super::arguments::Arguments;
use crate::cli::calibration::source::Source;

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
pub(super) fn existing(arguments: &Arguments) -> anyhow::Result<Option<NativeCalibration>> {
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
pub(super) fn put_into(
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
