//! The gradient of the smoothed luminance.

use super::plane::Plane;

/// Gaussian of 1.1 pixels.
const KERNEL: [f32; 7] = [
    0.008_831, 0.069_737, 0.241_062, 0.360_740, 0.241_062, 0.069_737, 0.008_831,
];
/// Least gradient of an edge, luminance per pixel, whatever the noise.
const MIN_EDGE: f32 = 0.7;
/// Largest threshold, luminance per pixel: a textured room has its edges nevertheless.
const MAX_EDGE: f32 = 4.0;
/// Threshold in medians of the gradient.
const EDGE_IN_MEDIANS: f32 = 2.5;

/// Gradient per pixel.
pub(super) struct Gradient {
    pub width: usize,
    pub height: usize,
    pub along_x: Vec<f32>,
    pub along_y: Vec<f32>,
    pub size: Vec<f32>,
    /// Smaller gradients are not edges.
    pub threshold: f32,
}

impl Gradient {
    pub(super) fn new(luminance: &Plane) -> Self {
        let smooth = luminance.blurred(&KERNEL);
        let (width, height) = (smooth.width, smooth.height);
        let count = width * height;
        let mut gradient = Self {
            width,
            height,
            along_x: vec![0.0; count],
            along_y: vec![0.0; count],
            size: vec![0.0; count],
            threshold: MIN_EDGE,
        };
        for y in 4..height.saturating_sub(4) {
            for x in 4..width.saturating_sub(4) {
                let at = y * width + x;
                let across = 0.5 * (smooth.values[at + 1] - smooth.values[at - 1]);
                let down = 0.5 * (smooth.values[at + width] - smooth.values[at - width]);
                gradient.along_x[at] = across;
                gradient.along_y[at] = down;
                gradient.size[at] = (across * across + down * down).sqrt();
            }
        }
        let mut sample: Vec<f32> = gradient
            .size
            .iter()
            .step_by(7)
            .copied()
            .filter(|size| *size > 0.05)
            .collect();
        if !sample.is_empty() {
            let middle = sample.len() / 2;
            let (_, median, _) = sample.select_nth_unstable_by(middle, f32::total_cmp);
            gradient.threshold = (EDGE_IN_MEDIANS * *median).clamp(MIN_EDGE, MAX_EDGE);
        }
        gradient
    }
}
