//! Frames from image files.

use std::path::Path;

use anyhow::Context;
use lookdown_common::files::{self, MAX_IMAGE_BYTES};
use lookdown_detect::imaging::{
    Frame,
    decode::{DecodeLimits, decode},
};

/// Decodes a frame from an image file.
pub(super) fn read_frame(path: &Path) -> anyhow::Result<Frame> {
    let encoded = files::read(path, MAX_IMAGE_BYTES).context("the file cannot be read")?;
    Ok(decode(&encoded, &DecodeLimits::default())?.frame)
}
