//! A piece of an edge in a frame: the image of a straight line of the room, if it fits.

/// A smooth piece of an edge, without corners.
#[derive(Debug, Clone, PartialEq)]
pub struct EdgeCurve {
    /// Points along the curve in pixel centers, at about the same distance from each other.
    pub points: Vec<[f64; 2]>,
    /// Pixels of the frame per pixel of the raster in which the edge was found. Positions are as
    /// much less exact.
    pub scale: f64,
}

impl EdgeCurve {
    /// The length of the chord in pixels.
    pub(super) fn length(&self) -> f64 {
        match (self.points.first(), self.points.last()) {
            (Some(first), Some(last)) => (last[0] - first[0]).hypot(last[1] - first[1]),
            _ => 0.0,
        }
    }
}
