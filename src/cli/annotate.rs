//! `--annotate`: the persons of a report, drawn into their image.

use std::{fs, path::Path};

use anyhow::{Context, bail};
use lookdown_detect::pipeline::DetectedFrame;

use crate::annotated_image::{AnnotationOptions, ImageFormat, annotated_image};

/// Draws the persons, and returns a JPEG.
pub(super) fn jpeg(
    detected: DetectedFrame,
    options: &AnnotationOptions,
) -> anyhow::Result<Vec<u8>> {
    Ok(annotated_image(detected, ImageFormat::Jpeg, options)?)
}

/// Returns the format that the name of an image file ends with.
///
/// # Errors
/// If the ending is not that of a JPEG or PNG file.
pub(super) fn format_of(path: &Path) -> anyhow::Result<ImageFormat> {
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    match ending.to_lowercase().as_str() {
        "jpg" | "jpeg" => Ok(ImageFormat::Jpeg),
        "png" => Ok(ImageFormat::Png),
        _ => bail!(
            "--annotate: {} does not end with .jpg, .jpeg or .png: give such a name",
            path.display()
        ),
    }
}

/// Draws the persons and writes a file in the format that its name ends with.
pub(super) fn write(
    detected: DetectedFrame,
    options: &AnnotationOptions,
    path: &Path,
) -> anyhow::Result<()> {
    let image = annotated_image(detected, format_of(path)?, options)?;
    fs::write(path, image)
        .with_context(|| format!("--annotate: {} cannot be written", path.display()))
}
