//! The edge of the lens image.

/// The edge of the lens image in pixel centers: the center of the top-left pixel is (0, 0).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LensCircle {
    /// Column of the center, in pixels.
    pub cx: f64,
    /// Row of the center, in pixels.
    pub cy: f64,
    /// Radius in pixels. The circle may extend beyond the frame.
    pub radius: f64,
}

impl LensCircle {
    /// Signed distance of a point from the circle in pixels, positive outside.
    pub(super) fn distance(&self, [x, y]: [f64; 2]) -> f64 {
        (x - self.cx).hypot(y - self.cy) - self.radius
    }

    /// Largest distance of a point from the circle to count as its rim: half a percent of the
    /// radius, but at least the size of pixels and compression blur.
    pub(super) fn tolerance(&self) -> f64 {
        (0.005 * self.radius).max(1.5)
    }
}
