//! One channel of numbers.

use crate::frame::Frame;

/// A raster of numbers, row by row.
pub(super) struct Plane {
    pub width: usize,
    pub height: usize,
    pub values: Vec<f32>,
}

impl Plane {
    /// The luminance of a frame (ITU-R BT.601), each side divided.
    pub(super) fn luminance(frame: &Frame, divisor: u32) -> Self {
        let step = divisor as usize;
        let (width, height) = (
            frame.width() as usize / step,
            frame.height() as usize / step,
        );
        let line = 3 * frame.width() as usize;
        let pixels = frame.pixels();
        let mut values = vec![0.0; width * height];
        let share = 1.0 / (step * step) as f32;
        for (y, row) in values.chunks_exact_mut(width).enumerate() {
            for inner in 0..step {
                let source = &pixels[(y * step + inner) * line..][..3 * step * width];
                for (value, group) in row.iter_mut().zip(source.chunks_exact(3 * step)) {
                    for rgb in group.chunks_exact(3) {
                        *value += share
                            * (0.299 * f32::from(rgb[0])
                                + 0.587 * f32::from(rgb[1])
                                + 0.114 * f32::from(rgb[2]));
                    }
                }
            }
        }
        Self {
            width,
            height,
            values,
        }
    }

    /// The plane after a Gaussian blur. The border of the width of the kernel stays as it was.
    pub(super) fn blurred(&self, kernel: &[f32]) -> Self {
        let reach = kernel.len() / 2;
        let mut across = self.values.clone();
        for (target, source) in across
            .chunks_exact_mut(self.width)
            .zip(self.values.chunks_exact(self.width))
        {
            for (value, window) in target[reach..].iter_mut().zip(source.windows(kernel.len())) {
                *value = window
                    .iter()
                    .zip(kernel)
                    .map(|(value, weight)| value * weight)
                    .sum();
            }
        }
        let mut values = across.clone();
        let rows = self.height.saturating_sub(2 * reach);
        for y in 0..rows {
            let target = &mut values[(y + reach) * self.width..][..self.width];
            target.fill(0.0);
            for (offset, weight) in kernel.iter().enumerate() {
                let source = &across[(y + offset) * self.width..][..self.width];
                for (value, source) in target.iter_mut().zip(source) {
                    *value += weight * source;
                }
            }
        }
        Self {
            width: self.width,
            height: self.height,
            values,
        }
    }
}
