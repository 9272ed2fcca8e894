//! `--annotate`: the persons of a report, drawn into their picture.

use std::{fs, path::Path};

use anyhow::Context;
use clap::Args;

use crate::{
    annotated_picture::{PictureFormat, PictureOptions, annotated_picture},
    pipeline::{Detected, ParameterError},
};

/// What the picture of `--annotate` shows, by the names and rules of requests.
#[derive(Debug, Default, Args)]
pub(super) struct PictureFlags {
    /// What is drawn: some of `boxes`, `oriented`, `scores`, `zones`, `views` and `timestamp`, with commas, or
    /// `none` [default: oriented,scores]
    #[arg(long, value_name = "LAYERS", requires = "annotate")]
    draw: Option<String>,
    /// Width of the picture, 64 to 8192 pixels; never wider than the frame [default: the frame's, 2048 at most]
    #[arg(long, value_name = "PIXELS", requires = "annotate")]
    width: Option<String>,
    /// Quality of a JPEG, 1 to 100 [default: 88]
    #[arg(long, value_name = "QUALITY", requires = "annotate")]
    quality: Option<String>,
}

impl PictureFlags {
    /// The checked options.
    ///
    /// # Errors
    /// [`ParameterError`], as of a request.
    pub(super) fn check(&self) -> Result<PictureOptions, ParameterError> {
        let values = [&self.draw, &self.width, &self.quality];
        PictureOptions::parse(values.map(Option::as_deref))
    }
}

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
