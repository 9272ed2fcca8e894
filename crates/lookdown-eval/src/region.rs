//! The interface between the matching and outlines of any shape.

use lookdown_detect::detection::BBox;

/// A part of the plane that can be compared with another.
pub trait Region {
    /// Intersection over union, 0 to 1. It is 0 if neither has any area.
    fn iou(&self, other: &Self) -> f64;

    /// The fraction of this region that lies in `other`, 0 to 1. It is 0 if this region has no
    /// area.
    fn share_in(&self, other: &Self) -> f64;
}

/// `part` divided by `whole`, or 0 if `whole` is 0.
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
