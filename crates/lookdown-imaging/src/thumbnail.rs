//! Reduced versions of images.

use image::{ImageBuffer, Rgb, imageops};

use super::Frame;

/// Scales the image down so that its longer side is `longer_side`, averaging all pixels. An image
/// that is not longer stays unchanged.
#[must_use]
pub fn thumbnail(frame: &Frame, longer_side: u32) -> Frame {
    let (width, height) = (frame.width(), frame.height());
    let longest = width.max(height);
    if longest <= longer_side {
        return frame.clone();
    }
    let scaled = |side: u32| {
        let scaled = u64::from(side) * u64::from(longer_side) / u64::from(longest);
        u32::try_from(scaled).unwrap_or(longer_side).max(1)
    };
    resized(frame, scaled(width), scaled(height))
}

/// Scales the image down to `width`, averaging all pixels. An image that is not wider stays
/// unchanged.
#[must_use]
pub fn narrowed(frame: &Frame, width: u32) -> Frame {
    if frame.width() <= width {
        return frame.clone();
    }
    let (rows, columns) = (u64::from(frame.height()), u64::from(frame.width()));
    // Rounded to the nearest integer, and not larger than before.
    let height = (rows * u64::from(width) + columns / 2) / columns;
    let height = u32::try_from(height).unwrap_or(frame.height()).max(1);
    resized(frame, width.max(1), height)
}

fn resized(frame: &Frame, width: u32, height: u32) -> Frame {
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
    fn a_thumbnail_keeps_the_shape_and_averages_what_it_leaves_out() {
        let stripes = [0, 0, 0, 200, 200, 200].repeat(4 * 8);
        let frame = Frame::new(8, 8, stripes).unwrap();
        let small = thumbnail(&frame, 2);
        assert_eq!((small.width(), small.height()), (2, 2));
        assert!(
            small
                .pixels()
                .iter()
                .all(|value| (80..=120).contains(value))
        );
        let wide = Frame::new(400, 100, vec![7; 400 * 100 * 3]).unwrap();
        let small = thumbnail(&wide, 40);
        assert_eq!((small.width(), small.height()), (40, 10));
        assert_eq!(small.pixel(39, 9), [7; 3]);
    }

    #[test]
    fn a_narrowed_image_has_the_width_and_the_nearest_height() {
        let frame = Frame::new(10, 5, vec![7; 150]).unwrap();
        let small = narrowed(&frame, 3);
        assert_eq!((small.width(), small.height()), (3, 2));
        assert_eq!(narrowed(&frame, 10), frame);
        let line = Frame::new(1000, 1, vec![9; 3000]).unwrap();
        assert_eq!(narrowed(&line, 10).height(), 1);
    }

    #[test]
    fn a_small_image_stays_unchanged() {
        let frame = Frame::new(3, 2, (0..18).collect()).unwrap();
        assert_eq!(thumbnail(&frame, 3), frame);
        let line = Frame::new(1000, 1, vec![9; 3000]).unwrap();
        assert_eq!(thumbnail(&line, 10).height(), 1);
    }
}
