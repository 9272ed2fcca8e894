//! Outline points: positions where scans from the frame's border inward leave the surround.

use super::surround::{Surround, brightness, margin};
use crate::frame::Frame;

/// Scan lines across each axis of the frame. Rows and columns together cover the outline of a
/// circle almost evenly.
const LINES: u32 = 160;

/// One point per scan line and side, in pixel centers, precise to about a pixel. Lines that start
/// inside the lens image, because the circle is cut off there, give no point.
pub(super) fn points(frame: &Frame, surround: &Surround) -> Vec<[f64; 2]> {
    let (width, height) = (frame.width(), frame.height());
    let mut points = Vec::new();
    for line in 0..LINES {
        let y = middle_of_slice(line, height);
        let row = |x: u32| is_lit(frame, surround, x, y);
        let (left, right) = (
            entry(width, frame, row),
            entry(width, frame, |x| row(width - 1 - x)),
        );
        points.extend(left.map(|x| [x, f64::from(y)]));
        points.extend(right.map(|x| [f64::from(width - 1) - x, f64::from(y)]));

        let x = middle_of_slice(line, width);
        let column = |y: u32| is_lit(frame, surround, x, y);
        let (top, bottom) = (
            entry(height, frame, column),
            entry(height, frame, |y| column(height - 1 - y)),
        );
        points.extend(top.map(|y| [f64::from(x), y]));
        points.extend(bottom.map(|y| [f64::from(x), f64::from(height - 1) - y]));
    }
    points
}

/// The pixel in the center of one of [`LINES`] equal slices of a side.
fn middle_of_slice(line: u32, side: u32) -> u32 {
    let middle = u64::from(2 * line + 1) * u64::from(side) / u64::from(2 * LINES);
    u32::try_from(middle).unwrap_or(side - 1)
}

fn is_lit(frame: &Frame, surround: &Surround, x: u32, y: u32) -> bool {
    f64::from(brightness(frame.pixel(x, y))) > surround.threshold
}

/// The number of pixels before a scan stays lit for several pixels. Specks, and most strokes of a
/// caption, are shorter.
fn entry(length: u32, frame: &Frame, is_lit: impl Fn(u32) -> bool) -> Option<f64> {
    let run_length = (frame.width().min(frame.height()) / 150).max(3);
    let start = margin(frame);
    if (start..start + run_length).any(&is_lit) {
        return None;
    }
    let mut run = 0;
    for at in start..length {
        run = if is_lit(at) { run + 1 } else { 0 };
        if run == run_length {
            return Some(f64::from(at + 1 - run_length) - 0.5);
        }
    }
    None
}
