//! `--annotate`: the persons of a report, drawn into their image.

use std::{fs, path::Path, time::Duration};

use anyhow::{Context, bail};
use lookdown_detect::pipeline::DetectedFrame;
use lookdown_watch::{VideoOptions, VideoWriter};
use tokio::runtime::Runtime;

use crate::annotated_image::{AnnotationOptions, ImageFormat, annotated_image};

/// A video into which the persons are drawn.
pub(super) struct AnnotatedVideo<'a> {
    writer: VideoWriter,
    path: &'a Path,
}

impl<'a> AnnotatedVideo<'a> {
    /// Starts a video with an interval of its frames.
    ///
    /// # Errors
    /// If `ffmpeg` is missing.
    pub(super) fn create(path: &'a Path, every: Duration, on: &Runtime) -> anyhow::Result<Self> {
        let _entered = on.enter();
        let writer = VideoWriter::create(path, every, &VideoOptions::default());
        let writer = writer.with_context(|| unwritable(path))?;
        Ok(Self { writer, path })
    }

    /// Draws the persons of a frame and appends it.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub(super) fn append(
        &mut self,
        detected: DetectedFrame,
        options: &AnnotationOptions,
        on: &Runtime,
    ) -> anyhow::Result<()> {
        let jpeg = annotated_image(detected, ImageFormat::Jpeg, options)?;
        let written = on.block_on(self.writer.write(&jpeg));
        written.with_context(|| unwritable(self.path))
    }

    /// Completes the video.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub(super) fn finish(self, on: &Runtime) -> anyhow::Result<()> {
        let finished = on.block_on(self.writer.finish());
        finished.with_context(|| unwritable(self.path))
    }
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
    fs::write(path, image).with_context(|| unwritable(path))
}

fn unwritable(path: &Path) -> String {
    format!("--annotate: {} cannot be written", path.display())
}
