//! The affine map from normalized image coordinates to pixels.

use super::{
    LensError,
    error::{finite, positive},
};
use crate::geometry::Pixel;

/// `fx, fy, cx, cy`: focal lengths and principal point in pixels, pixel centers.
pub type Pinhole = [f64; 4];

/// `u = fx·x + skew·y + cx`, `v = row_skew·x + fy·y + cy`: normalized coordinates to pixel centers.
///
/// Kannala-Brandt files give the skew as `alpha` with `skew = fx·alpha`
/// (OpenCV's fisheye module).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImagePlane {
    /// Horizontal focal length, pixels.
    pub fx: f64,
    /// Vertical focal length, pixels.
    pub fy: f64,
    /// Horizontal shift per unit of normalized `y`, pixels; 0 for almost every camera.
    pub skew: f64,
    /// Vertical shift per unit of normalized `x`, pixels; only `ocam` and `f_theta` files have it.
    pub row_skew: f64,
    /// Principal point, horizontal, pixel centers.
    pub cx: f64,
    /// Principal point, vertical, pixel centers.
    pub cy: f64,
}

impl ImagePlane {
    /// An image plane without skew.
    pub fn new(fx: f64, fy: f64, cx: f64, cy: f64) -> Self {
        Self {
            fx,
            fy,
            skew: 0.0,
            row_skew: 0.0,
            cx,
            cy,
        }
    }

    pub(super) fn check(&self) -> Result<(), LensError> {
        for (name, value) in [
            ("fx", self.fx),
            ("fy", self.fy),
            ("skew", self.skew),
            ("row_skew", self.row_skew),
            ("cx", self.cx),
            ("cy", self.cy),
        ] {
            finite(name, value)?;
        }
        for (name, value) in [("fx", self.fx), ("fy", self.fy)] {
            positive(name, value)?;
        }
        let is_orienting = self.determinant() > 0.0;
        if !is_orienting {
            let Self {
                fx,
                fy,
                skew,
                row_skew,
                ..
            } = self;
            return Err(LensError::new(format!(
                "the affine part [[{fx}, {skew}], [{row_skew}, {fy}]] flattens or mirrors the \
                 image: its off-diagonal terms must be small against its diagonal"
            )));
        }
        Ok(())
    }

    fn determinant(&self) -> f64 {
        self.fx * self.fy - self.skew * self.row_skew
    }

    pub(super) fn pixel_from_normalized(&self, x: f64, y: f64) -> Pixel {
        Pixel::new(
            self.fx * x + self.skew * y + self.cx,
            self.row_skew * x + self.fy * y + self.cy,
        )
    }

    pub(super) fn normalized_from_pixel(&self, pixel: &Pixel) -> (f64, f64) {
        let (right, down) = (pixel.x - self.cx, pixel.y - self.cy);
        let determinant = self.determinant();
        (
            (self.fy * right - self.skew * down) / determinant,
            (self.fx * down - self.row_skew * right) / determinant,
        )
    }

    pub(super) fn scaled(&self, scale_x: f64, scale_y: f64) -> Self {
        Self {
            fx: self.fx * scale_x,
            fy: self.fy * scale_y,
            skew: self.skew * scale_x,
            row_skew: self.row_skew * scale_y,
            cx: (self.cx + 0.5) * scale_x - 0.5,
            cy: (self.cy + 0.5) * scale_y - 0.5,
        }
    }
}
