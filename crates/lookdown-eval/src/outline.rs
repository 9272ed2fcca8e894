//! The outline of a person, annotated or detected, in the shape that is compared.

use std::fmt;

use lookdown_detect::detection::{BBox, FramePixels};
use lookdown_lens::geometry::OrientedBox;

use super::{Region, RotatedBox};

/// The shape of the ground truth, which determines the compared shape of a detection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scoring {
    /// Axis-parallel boxes by their intersection over union.
    AxisParallel,
    /// Rotated boxes by the intersection over union of their masks.
    Rotated,
    /// Head points: an axis-parallel box is right if it contains the point.
    HeadPoint,
}

/// The outline of a person in frame pixels.
///
/// An axis-parallel box and a rotated box are never compared: a data set has one shape of ground
/// truth, and [`Scoring`] converts detections to the matching shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outline {
    /// An axis-parallel box.
    AxisParallel(BBox<FramePixels>),
    /// A rotated box.
    Rotated(RotatedBox),
    /// The center of a head, `[x, y]`, corner-origin.
    Head([f64; 2]),
}

impl Scoring {
    /// Returns the compared outline of a person detected in a frame of `[width, height]` pixels. If
    /// the ground truth is rotated it is the oriented box, or the axis-parallel box if there is
    /// none.
    pub fn outline(
        self,
        bbox: BBox<FramePixels>,
        oriented_box: Option<&OrientedBox>,
        frame: [u32; 2],
    ) -> Outline {
        let rotated = match (self, oriented_box) {
            (Self::AxisParallel | Self::HeadPoint, _) => None,
            (Self::Rotated, Some(oriented_box)) => {
                RotatedBox::from_oriented_box(oriented_box, frame)
            }
            (Self::Rotated, None) => {
                let [cx, cy] = bbox.center();
                RotatedBox::new([cx, cy, bbox.width(), bbox.height()], 0.0, frame)
            }
        };
        rotated.map_or(Outline::AxisParallel(bbox), Outline::Rotated)
    }
}

impl fmt::Display for Scoring {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::AxisParallel => "axis-parallel boxes",
            Self::Rotated => "rotated boxes",
            Self::HeadPoint => "head points",
        })
    }
}

impl Outline {
    /// The center, `[x, y]`, corner-origin frame pixels.
    pub fn center(&self) -> [f64; 2] {
        match self {
            Self::AxisParallel(bbox) => bbox.center(),
            Self::Rotated(rotated) => rotated.center(),
            Self::Head(point) => *point,
        }
    }

    /// Width times height, square pixels. `None` for a point.
    pub fn area(&self) -> Option<f64> {
        match self {
            Self::AxisParallel(bbox) => Some(bbox.area()),
            Self::Rotated(rotated) => Some(rotated.full_area()),
            Self::Head(_) => None,
        }
    }
}

impl Region for Outline {
    /// Intersection over union of equal shapes. For a box and a head it is 1 if the box contains
    /// the head (edges included), else 0.
    fn iou(&self, other: &Self) -> f64 {
        match (self, other) {
            (Self::AxisParallel(a), Self::AxisParallel(b)) => a.iou(b),
            (Self::Rotated(a), Self::Rotated(b)) => Region::iou(a, b),
            (Self::AxisParallel(bbox), Self::Head(point))
            | (Self::Head(point), Self::AxisParallel(bbox)) => {
                f64::from(u8::from(holds(bbox, *point)))
            }
            _ => 0.0,
        }
    }

    fn share_in(&self, other: &Self) -> f64 {
        match (self, other) {
            (Self::AxisParallel(a), Self::AxisParallel(b)) => a.share_in(b),
            (Self::Rotated(a), Self::Rotated(b)) => a.share_in(b),
            _ => 0.0,
        }
    }
}

fn holds(bbox: &BBox<FramePixels>, [x, y]: [f64; 2]) -> bool {
    let [x_min, y_min, x_max, y_max] = bbox.corners();
    (x_min..=x_max).contains(&x) && (y_min..=y_max).contains(&y)
}

#[cfg(test)]
mod tests;
