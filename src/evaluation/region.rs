//! What the matching needs to know about a box of whatever shape.

use crate::detection::BBox;

/// A part of the plane: an axis-parallel box, or any other shape that knows its overlaps.
pub trait Region {
    /// Area, at least 0.
    fn area(&self) -> f64;

    /// Area shared with `other`, at least 0.
    fn intersection_area(&self, other: &Self) -> f64;

    /// Intersection over union, 0 to 1; 0 when neither has any area.
    fn iou(&self, other: &Self) -> f64 {
        let intersection = self.intersection_area(other);
        share(intersection, self.area() + other.area() - intersection)
    }

    /// The share of this region that lies in `other`, 0 to 1; 0 when it has no area.
    fn share_in(&self, other: &Self) -> f64 {
        share(self.intersection_area(other), self.area())
    }
}

fn share(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { part / whole } else { 0.0 }
}

impl<S> Region for BBox<S> {
    fn area(&self) -> f64 {
        BBox::area(self)
    }

    fn intersection_area(&self, other: &Self) -> f64 {
        BBox::intersection_area(self, other)
    }
}
