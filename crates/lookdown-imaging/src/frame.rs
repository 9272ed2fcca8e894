//! A decoded image in the pixel format that every stage uses.

use std::ops::Range;

use image::{ImageBuffer, Rgb, imageops};

use crate::buffer_pool::{Pixels, zeros};

/// An image in 8-bit RGB, rows from top to bottom, without padding.
///
/// *Invariant:* both sides are at least 1 and there are exactly `width * height * 3` bytes.
#[derive(Clone, PartialEq, Eq)]
pub struct Frame {
    width: u32,
    height: u32,
    pixels: Pixels,
}

/// Bytes that do not form a [`Frame`].
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct FrameError(String);

impl Frame {
    /// Wraps row-major RGB bytes.
    ///
    /// # Errors
    /// Returns an error if a side is zero, or `pixels` is not `width * height * 3` bytes long.
    pub fn new(width: u32, height: u32, pixels: Vec<u8>) -> Result<Self, FrameError> {
        if width == 0 || height == 0 {
            let problem = "has no pixels; both sides must be at least 1";
            return Err(FrameError(format!(
                "a frame of {width}×{height} pixels {problem}"
            )));
        }
        // The product of two u32 and a small factor cannot overflow a u128.
        if u128::from(width) * u128::from(height) * 3 != pixels.len() as u128 {
            return Err(FrameError(format!(
                "a frame of {width}×{height} pixels takes width × height × 3 bytes of RGB, not {}",
                pixels.len()
            )));
        }
        Ok(Self {
            width,
            height,
            pixels: pixels.into(),
        })
    }

    /// A black image. A side of zero becomes 1.
    pub fn black(width: u32, height: u32) -> Self {
        let (width, height) = (width.max(1), height.max(1));
        Self {
            width,
            height,
            pixels: zeros(3 * width as usize * height as usize).into(),
        }
    }

    /// Width in pixels, at least 1.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels, at least 1.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// All bytes: R, G and B of the top-left pixel, then of the pixel to its right, and so on.
    pub fn pixels(&self) -> &[u8] {
        &self.pixels
    }

    /// The same bytes, mutable.
    pub fn pixels_mut(&mut self) -> &mut [u8] {
        &mut self.pixels
    }

    /// Copies the given columns and rows, clipped to the frame.
    ///
    /// # Errors
    /// [`FrameError`] when the range lies outside the frame.
    pub fn crop(&self, columns: Range<u32>, rows: Range<u32>) -> Result<Self, FrameError> {
        let columns = columns.start..columns.end.min(self.width);
        let rows = rows.start..rows.end.min(self.height);
        let (width, height) = (columns.len(), rows.len());
        let mut pixels = Vec::with_capacity(width * height * 3);
        if width > 0 {
            for row in rows {
                let start = 3 * (row as usize * self.width as usize + columns.start as usize);
                pixels.extend_from_slice(&self.pixels[start..start + 3 * width]);
            }
        }
        let side = |length: usize| u32::try_from(length).unwrap_or(u32::MAX);
        Self::new(side(width), side(height), pixels)
    }

    /// R, G and B of the pixel in column `x` and row `y`.
    ///
    /// # Panics
    /// Panics if the pixel lies outside the frame.
    pub fn pixel(&self, x: u32, y: u32) -> [u8; 3] {
        assert!(
            x < self.width && y < self.height,
            "pixel ({x}, {y}) lies outside a frame of {}×{}",
            self.width,
            self.height
        );
        let start = 3 * (y as usize * self.width as usize + x as usize);
        [
            self.pixels[start],
            self.pixels[start + 1],
            self.pixels[start + 2],
        ]
    }
}

/// Prints the size only, to keep megabytes of pixels out of log lines.
impl std::fmt::Debug for Frame {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "Frame({}×{})", self.width, self.height)
    }
}

/// Scales the image down to `width`, averaging all pixels. An image that is not wider stays
/// unchanged.
pub fn narrowed(frame: &Frame, width: u32) -> Frame {
    if frame.width() <= width {
        return frame.clone();
    }
    let (rows, columns) = (u64::from(frame.height()), u64::from(frame.width()));
    // Rounded to the nearest integer, and not larger than before.
    let height = (rows * u64::from(width) + columns / 2) / columns;
    let height = u32::try_from(height).unwrap_or(frame.height()).max(1);
    let width = width.max(1);
    ImageBuffer::<Rgb<u8>, _>::from_raw(frame.width(), frame.height(), frame.pixels())
        .map(|image| imageops::thumbnail(&image, width, height))
        .and_then(|small| Frame::new(width, height, small.into_raw()).ok())
        // No step can fail: the buffer length of a frame matches its size.
        .unwrap_or_else(|| frame.clone())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_narrowed_image_has_the_width_and_the_nearest_height() {
        let frame = Frame::new(10, 5, [0, 0, 0, 9, 9, 9].repeat(25)).unwrap();
        let small = narrowed(&frame, 3);
        assert_eq!((small.width(), small.height()), (3, 2));
        assert!(small.pixels().iter().all(|value| (2..=7).contains(value)));
        assert_eq!(narrowed(&frame, 10), frame);
        let line = Frame::new(1000, 1, vec![9; 3000]).unwrap();
        assert_eq!(narrowed(&line, 10).height(), 1);
    }
}
