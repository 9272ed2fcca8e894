//! Frames from image files.

use std::{fs, path::Path};

use anyhow::Context;
use lookdown_detect::imaging::{
    Frame,
    decode::{DecodeLimits, decode},
};

/// Decodes a frame from an image file.
pub(super) fn read_frame(path: &Path) -> anyhow::Result<Frame> {
    let encoded = fs::read(path).context("the file cannot be read")?;
    Ok(decode(&encoded, &DecodeLimits::default())?.frame)
}
