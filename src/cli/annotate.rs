//! `--annotate`: the persons of a report, drawn into their picture.

use std::{fs, path::Path};

use anyhow::Context;

use crate::{
    annotated_picture::{PictureFormat, PictureOptions, annotated_picture},
    pipeline::Detected,
};

/// Draws the persons and writes a file: PNG if its name ends so, else JPEG.
pub(super) fn write(
    detected: Detected,
    options: &PictureOptions,
    path: &Path,
) -> anyhow::Result<()> {
    let ending = path.extension().unwrap_or_default();
    let format = if ending.eq_ignore_ascii_case("png") {
        PictureFormat::Png
    } else {
        PictureFormat::Jpeg
    };
    let picture = annotated_picture(detected, format, options)?;
    fs::write(path, picture)
        .with_context(|| format!("--annotate: {} cannot be written", path.display()))
}
