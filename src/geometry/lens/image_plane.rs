//! The affine map from normalised image coordinates to pixels.

use super::LensError;
use crate::geometry::Pixel;

/// `u = fx·x + skew·y + cx`, `v = fy·y + cy`: normalised coordinates to pixel centres.
///
/// Kannala-Brandt files give the skew as `alpha` with `skew = fx·alpha`
/// (OpenCV's fisheye module).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImagePlane {
    /// Horizontal focal length, pixels.
    pub fx: f64,
    /// Vertical focal length, pixels.
    pub fy: f64,
    /// Horizontal shift per unit of normalised `y`, pixels; 0 for almost every camera.
    pub skew: f64,
    /// Principal point, horizontal, pixel centres.
    pub cx: f64,
    /// Principal point, vertical, pixel centres.
    pub cy: f64,
}

impl ImagePlane {
    /// An image plane without skew.
    #[must_use]
    pub fn new(fx: f64, fy: f64, cx: f64, cy: f64) -> Self {
        Self {
            fx,
            fy,
            skew: 0.0,
            cx,
            cy,
        }
    }

    pub(super) fn check(&self) -> Result<(), LensError> {
        for (name, value) in [
            ("fx", self.fx),
            ("fy", self.fy),
            ("skew", self.skew),
            ("cx", self.cx),
            ("cy", self.cy),
        ] {
            if !value.is_finite() {
                return Err(LensError::NotFinite { name, value });
            }
        }
        for (name, value) in [("fx", self.fx), ("fy", self.fy)] {
            if value <= 0.0 {
                return Err(LensError::NotPositive { name, value });
            }
        }
        Ok(())
    }

    pub(super) fn pixel_from_normalised(&self, x: f64, y: f64) -> Pixel {
        Pixel::new(self.fx * x + self.skew * y + self.cx, self.fy * y + self.cy)
    }

    pub(super) fn normalised_from_pixel(&self, pixel: &Pixel) -> (f64, f64) {
        let y = (pixel.y - self.cy) / self.fy;
        let x = (pixel.x - self.cx - self.skew * y) / self.fx;
        (x, y)
    }

    pub(super) fn scaled(&self, scale_x: f64, scale_y: f64) -> Self {
        Self {
            fx: self.fx * scale_x,
            fy: self.fy * scale_y,
            skew: self.skew * scale_x,
            cx: (self.cx + 0.5) * scale_x - 0.5,
            cy: (self.cy + 0.5) * scale_y - 0.5,
        }
    }
}
