//! `--annotate`: the persons of a report, drawn into their picture.

use std::{fs, path::Path};

use anyhow::Context;
use lookdown_detect::pipeline::Detected;

use crate::annotated_image::{AnnotationOptions, ImageFormat, annotated_image};

/// Draws the persons, and returns a JPEG.
pub(super) fn jpeg(detected: Detected, options: &AnnotationOptions) -> anyhow::Result<Vec<u8>> {
    Ok(annotated_image(detected, ImageFormat::Jpeg, options)?)
}

/// Draws the persons and writes a file: PNG if its name ends so, else JPEG.
pub(super) fn write(
    detected: Detected,
    options: &AnnotationOptions,
    path: &Path,
) -> anyhow::Result<()> {
    let ending = path.extension().unwrap_or_default();
    let format = if ending.eq_ignore_ascii_case("png") {
        ImageFormat::Png
    } else {
        ImageFormat::Jpeg
    };
    let picture = annotated_image(detected, format, options)?;
    fs::write(path, picture)
        .with_context(|| format!("--annotate: {} cannot be written", path.display()))
}
