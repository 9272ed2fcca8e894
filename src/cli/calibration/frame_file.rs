//! Frames from image files.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use lookdown_calibration::native::NativeImage;
use lookdown_common::files::{self, MAX_IMAGE_BYTES};
use lookdown_imaging::{
    Frame,
    decode::{DecodeLimits, decode},
};

/// Decodes a frame from an image file.
pub(super) fn read_frame(path: &Path) -> anyhow::Result<Frame> {
    let encoded = files::read(path, MAX_IMAGE_BYTES).context("the file cannot be read")?;
    Ok(decode(&encoded, &DecodeLimits::default())?.frame)
}

/// Reads the frames of one camera, which must have one size.
pub(super) fn read_frames(paths: &[PathBuf]) -> anyhow::Result<(NativeImage, Vec<Frame>)> {
    let mut frames: Vec<Frame> = Vec::with_capacity(paths.len());
    for path in paths {
        let frame = read_frame(path).with_context(|| path.display().to_string())?;
        if let Some(first) = frames.first()
            && (frame.width(), frame.height()) != (first.width(), first.height())
        {
            bail!(
                "{}: {}x{} pixels, but the first frame has {}x{}: give frames of one camera at one \
                 size",
                path.display(),
                frame.width(),
                frame.height(),
                first.width(),
                first.height()
            );
        }
        frames.push(frame);
    }
    let first = frames.first().context("give at least one frame")?;
    let (width, height) = (first.width(), first.height());
    Ok((NativeImage { width, height }, frames))
}
