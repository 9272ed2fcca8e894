//! What the matching needs to know about an outline of whatever shape.

use crate::detection::BBox;

/// A part of the plane that knows how far it agrees with another.
pub trait Region {
    /// Intersection over union, 0 to 1; 0 when neither has any area.
    fn iou(&self, other: &Self) -> f64;

    /// The share of this region that lies in `other`, 0 to 1; 0 when it has no area.
    fn share_in(&self, other: &Self) -> f64;
}

/// `part` by `whole`; 0 of nothing.
pub(super) fn share(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { part / whole } else { 0.0 }
}

impl<S> Region for BBox<S> {
    fn iou(&self, other: &Self) -> f64 {
        BBox::iou(self, other)
    }

    fn share_in(&self, other: &Self) -> f64 {
        share(self.intersection_area(other), self.area())
    }
}
