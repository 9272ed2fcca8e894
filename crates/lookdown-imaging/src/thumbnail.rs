//! Reduced versions of images.

use image::{ImageBuffer, Rgb, imageops};

use super::Frame;

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
