//! Axis-parallel boxes whose pixel space is part of their type.

use std::marker::PhantomData;

/// The pixels of one virtual view.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ViewPixels;

/// The pixels of the fisheye frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FramePixels;

/// Coordinates that do not form a box.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum BBoxError {
    /// A coordinate is NaN, infinite or beyond ±1e9.
    #[error(
        "box coordinate {0} is not a pixel position; use finite numbers within ±{limit:e}",
        limit = MAX_COORDINATE
    )]
    Coordinate(f64),
    /// The minimum of an axis exceeds its maximum.
    #[error("box {0:?} is inverted; give x_min, y_min, x_max, y_max with each min ≤ max")]
    Inverted([f64; 4]),
}

/// Larger than any image, and small enough that areas and sums over all boxes stay finite.
const MAX_COORDINATE: f64 = 1e9;

/// A box in the pixel space `S` ([`ViewPixels`] or [`FramePixels`]) with corner-origin, continuous
/// coordinates. Always finite and never inverted. Zero width or height is allowed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BBox<S> {
    x_min: f64,
    y_min: f64,
    x_max: f64,
    y_max: f64,
    space: PhantomData<S>,
}

impl BBox<FramePixels> {
    /// The box that covers a whole frame.
    pub fn for_frame(width: u32, height: u32) -> Self {
        Self::from_ordered([0.0, 0.0, f64::from(width), f64::from(height)])
    }
}

impl<S> BBox<S> {
    /// Builds the box `[x_min, y_min, x_max, y_max]`, in pixels.
    ///
    /// # Errors
    /// [`BBoxError`] when a coordinate is not finite or beyond ±1e9, or a min exceeds its max.
    pub fn new(corners: [f64; 4]) -> Result<Self, BBoxError> {
        let [x_min, y_min, x_max, y_max] = corners;
        for coordinate in corners {
            // NaN is outside every range.
            if !(-MAX_COORDINATE..=MAX_COORDINATE).contains(&coordinate) {
                return Err(BBoxError::Coordinate(coordinate));
            }
        }
        if x_min > x_max || y_min > y_max {
            return Err(BBoxError::Inverted(corners));
        }
        Ok(Self::from_ordered(corners))
    }

    fn from_ordered([x_min, y_min, x_max, y_max]: [f64; 4]) -> Self {
        Self {
            x_min,
            y_min,
            x_max,
            y_max,
            space: PhantomData,
        }
    }

    /// `[x_min, y_min, x_max, y_max]`, pixels.
    pub fn corners(&self) -> [f64; 4] {
        [self.x_min, self.y_min, self.x_max, self.y_max]
    }

    /// Extent along x, pixels, at least 0.
    pub fn width(&self) -> f64 {
        self.x_max - self.x_min
    }

    /// Extent along y, pixels, at least 0.
    pub fn height(&self) -> f64 {
        self.y_max - self.y_min
    }

    /// Width times height, in square pixels. Coordinates are continuous, so no pixel is added to
    /// the sides.
    pub fn area(&self) -> f64 {
        self.width() * self.height()
    }

    /// The center `[x, y]`, in pixels.
    pub fn center(&self) -> [f64; 2] {
        [
            f64::midpoint(self.x_min, self.x_max),
            f64::midpoint(self.y_min, self.y_max),
        ]
    }

    /// The area shared with `other`, in square pixels. 0 for boxes that only touch.
    pub fn intersection_area(&self, other: &Self) -> f64 {
        // Each side is clamped separately, so that two negative overlaps do not multiply to a
        // positive area.
        let width = (self.x_max.min(other.x_max) - self.x_min.max(other.x_min)).max(0.0);
        let height = (self.y_max.min(other.y_max) - self.y_min.max(other.y_min)).max(0.0);
        width * height
    }

    /// Intersection over union, 0 to 1. 0 when neither box has an area.
    pub fn iou(&self, other: &Self) -> f64 {
        let intersection = self.intersection_area(other);
        let union = self.area() + other.area() - intersection;
        if union > 0.0 {
            intersection / union
        } else {
            0.0
        }
    }

    /// Returns the part inside `bounds`, or `None` when that part has no area.
    pub fn clipped_to(&self, bounds: &Self) -> Option<Self> {
        (self.intersection_area(bounds) > 0.0).then(|| {
            Self::from_ordered([
                self.x_min.max(bounds.x_min),
                self.y_min.max(bounds.y_min),
                self.x_max.min(bounds.x_max),
                self.y_max.min(bounds.y_max),
            ])
        })
    }

    /// Returns the box `share` (0 to 1) of the way from this box to `other`.
    pub(super) fn moved_towards(&self, other: &Self, share: f64) -> Self {
        // Both factors are the same for every edge and rounding is monotonic, so min stays ≤ max.
        let between = |here: f64, there: f64| here * (1.0 - share) + there * share;
        Self::from_ordered([
            between(self.x_min, other.x_min),
            between(self.y_min, other.y_min),
            between(self.x_max, other.x_max),
            between(self.y_max, other.y_max),
        ])
    }
}

#[cfg(test)]
mod tests;
