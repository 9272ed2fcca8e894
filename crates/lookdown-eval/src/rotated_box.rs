//! Rotated boxes, compared by the masks that they cover.
//!
//! A mask is the set of the frame's pixels whose centers lie in the box. The evaluation of CEPDOF
//! (Duan et al., RAPiD, CVPR Workshops 2020) also rasterizes boxes before it compares them, so the
//! part outside the frame does not count. Masks are not stored: the box is convex, so its pixels in
//! one row are one span, which is calculated on demand.

use lookdown_detect::detection::{BBox, BBoxError, FramePixels};
use lookdown_lens::geometry::OrientedBox;

/// A rectangle rotated about its center, represented by the pixels that it covers in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RotatedBox {
    center: [f64; 2],
    /// Extent across the height axis, pixels.
    width: f64,
    /// Extent along the height axis, pixels.
    height: f64,
    sin: f64,
    cos: f64,
    /// Width and height of the frame, pixels.
    frame: [u32; 2],
}

/// Far beyond any image, yet small enough that areas stay finite.
const MAX_COORDINATE: f64 = 1e9;
/// The largest side of a frame. It bounds the cost of a comparison.
const MAX_FRAME_SIDE: u32 = 65_536;

impl RotatedBox {
    /// Creates the box `[cx, cy, width, height]` (corner-origin frame pixels), rotated clockwise by
    /// `angle` radians, in a frame of `[width, height]` pixels. Returns `None` unless all numbers
    /// are finite and within ±1e9, the extents are not negative, and the frame's sides are at most
    /// 65 536.
    pub fn new([cx, cy, width, height]: [f64; 4], angle: f64, frame: [u32; 2]) -> Option<Self> {
        let within = |value: f64| (-MAX_COORDINATE..=MAX_COORDINATE).contains(&value);
        let valid = [cx, cy, width, height].into_iter().all(within)
            && width >= 0.0
            && height >= 0.0
            && angle.is_finite()
            && frame.iter().all(|side| *side <= MAX_FRAME_SIDE);
        let (sin, cos) = angle.sin_cos();
        valid.then_some(Self {
            center: [cx, cy],
            width,
            height,
            sin,
            cos,
            frame,
        })
    }

    /// Creates the oriented box of a detection, in a frame of `[width, height]` pixels. Returns
    /// `None` as [`RotatedBox::new`] does.
    pub fn from_oriented_box(oriented_box: &OrientedBox, frame: [u32; 2]) -> Option<Self> {
        let (center, angle) = (oriented_box.center, oriented_box.angle);
        let sides = [oriented_box.width, oriented_box.height];
        Self::new([center.x, center.y, sides[0], sides[1]], angle, frame)
    }

    /// The center, `[x, y]`, corner-origin frame pixels.
    pub fn center(&self) -> [f64; 2] {
        self.center
    }

    /// Width times height, square pixels, including the part outside the frame.
    pub fn full_area(&self) -> f64 {
        self.width * self.height
    }

    /// The axis-parallel bounds of the ellipse inscribed in the box, which are compared with
    /// axis-parallel detections. The bounds of the box itself would be far larger than the person,
    /// as its corners are empty. The half extents of an ellipse with semi-axes `a`, `b` rotated by
    /// `t` are `√(a² cos² t + b² sin² t)` and `√(a² sin² t + b² cos² t)`: its support function
    /// along the axes.
    ///
    /// # Errors
    /// [`BBoxError`] if an edge lies beyond ±1e9 pixels.
    pub fn inscribed_ellipse_bounds(&self) -> Result<BBox<FramePixels>, BBoxError> {
        let (a, b) = (self.width / 2.0, self.height / 2.0);
        let half_width = (a * self.cos).hypot(b * self.sin);
        let half_height = (a * self.sin).hypot(b * self.cos);
        let [cx, cy] = self.center;
        BBox::new([
            cx - half_width,
            cy - half_height,
            cx + half_width,
            cy + half_height,
        ])
    }

    /// The rows of the frame that may contain pixels of the box, `start..end`.
    fn rows(&self) -> [f64; 2] {
        let half_height = f64::midpoint(self.width * self.sin.abs(), self.height * self.cos.abs());
        first_and_end(
            self.center[1] - half_height,
            self.center[1] + half_height,
            self.frame[1],
        )
    }

    /// The columns whose pixels in `row` have their centers in the box, `start..end`. Empty if the
    /// end is not greater than the start.
    fn columns(&self, row: f64) -> [f64; 2] {
        let dy = row + 0.5 - self.center[1];
        // Along the width axis (cos, sin) and along the height axis (−sin, cos), from the center.
        let across = interval(self.cos, dy * self.sin, self.width / 2.0);
        let along = interval(-self.sin, dy * self.cos, self.height / 2.0);
        let left = across[0].max(along[0]) + self.center[0];
        let right = across[1].min(along[1]) + self.center[0];
        first_and_end(left, right, self.frame[0])
    }

    /// The radius of the circle through the corners, pixels.
    fn radius(&self) -> f64 {
        self.width.hypot(self.height) / 2.0
    }

    /// The number of pixels in the mask.
    fn area(&self) -> f64 {
        let [first, end] = self.rows();
        rows(first, end).map(|row| length(self.columns(row))).sum()
    }

    /// The number of pixels in both masks.
    fn intersection_area(&self, other: &Self) -> f64 {
        let [dx, dy] = [0, 1].map(|axis| self.center[axis] - other.center[axis]);
        if dx.hypot(dy) > self.radius() + other.radius() {
            return 0.0;
        }
        let (mine, theirs) = (self.rows(), other.rows());
        rows(mine[0].max(theirs[0]), mine[1].min(theirs[1]))
            .map(|row| {
                let (mine, theirs) = (self.columns(row), other.columns(row));
                length([mine[0].max(theirs[0]), mine[1].min(theirs[1])])
            })
            .sum()
    }
}

impl Region for RotatedBox {
    fn iou(&self, other: &Self) -> f64 {
        let intersection = self.intersection_area(other);
        if intersection == 0.0 {
            return 0.0;
        }
        share(intersection, self.area() + other.area() - intersection)
    }

    fn share_in(&self, other: &Self) -> f64 {
        share(self.intersection_area(other), self.area())
    }
}

/// The interval in which `slope · x + offset` is within ± `limit`.
fn interval(slope: f64, offset: f64, limit: f64) -> [f64; 2] {
    if slope == 0.0 {
        return if offset.abs() <= limit {
            [f64::NEG_INFINITY, f64::INFINITY]
        } else {
            [0.0, 0.0]
        };
    }
    let ends = [(-limit - offset) / slope, (limit - offset) / slope];
    [ends[0].min(ends[1]), ends[0].max(ends[1])]
}

/// The pixels, `first..end`, whose centers lie from `low` up to but excluding `high`, within a
/// frame side of `side` pixels.
fn first_and_end(low: f64, high: f64, side: u32) -> [f64; 2] {
    [low, high].map(|edge| (edge - 0.5).ceil().clamp(0.0, f64::from(side)))
}

fn rows(first: f64, end: f64) -> impl Iterator<Item = f64> {
    std::iter::successors(Some(first), |row| Some(row + 1.0)).take_while(move |row| *row < end)
}

fn length([first, end]: [f64; 2]) -> f64 {
    (end - first).max(0.0)
}

/// A part of the plane that can be compared with another.
pub trait Region {
    /// Intersection over union, 0 to 1. It is 0 if neither has any area.
    fn iou(&self, other: &Self) -> f64;

    /// The fraction of this region that lies in `other`, 0 to 1. It is 0 if this region has no
    /// area.
    fn share_in(&self, other: &Self) -> f64;
}

/// `part` divided by `whole`, or 0 if `whole` is 0.
fn share(part: f64, whole: f64) -> f64 {
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

#[cfg(test)]
mod tests;
