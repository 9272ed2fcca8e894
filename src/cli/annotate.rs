//! `--annotate`: the persons of a report, drawn into their picture.

use std::{fs, path::Path};

use anyhow::Context;

use crate::{
    annotated_picture::{PictureFormat, PictureOptions, annotated_picture},
    pipeline::Detected,
};

/// Draws the persons and writes a JPEG file.
pub(super) fn write(detected: Detected, path: &Path) -> anyhow::Result<()> {
    let options = PictureOptions::default();
    let picture = annotated_picture(detected, PictureFormat::Jpeg, &options)?;
    fs::write(path, picture)
        .with_context(|| format!("--annotate: {} cannot be written", path.display()))
}
