//! Marks to draw into a frame.

use lookdown_lens::geometry::{OrientedBox, Pixel};
use serde::{Deserialize, Serialize};

use super::is_drawable;

/// One mark. All coordinates are corner-origin frame pixels: pixel i covers [i, i + 1).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mark {
    /// Axis-aligned box: x and y of its top-left corner, then of its bottom-right corner.
    pub bbox: [f64; 4],
    /// The box along the person.
    pub oriented: Option<OrientedMark>,
    /// The head, which labels keep clear of.
    pub head: Option<Head>,
    /// Text of the plate at the box, for example a score. Empty draws no plate.
    pub label: String,
}

/// A rotated box.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct OrientedMark {
    /// Column of the center.
    pub cx: f64,
    /// Row of the center.
    pub cy: f64,
    /// Extent across the height axis, in pixels.
    pub width: f64,
    /// Extent along the height axis, in pixels.
    pub height: f64,
    /// Clockwise rotation of the height axis from image up, in degrees.
    pub angle_deg: f64,
}

/// A circle around a head.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Head {
    /// Column of the center.
    pub cx: f64,
    /// Row of the center.
    pub cy: f64,
    /// Radius in pixels.
    pub radius: f64,
}

impl Mark {
    /// A mark of an axis-aligned box alone. An empty `label` draws no plate.
    pub fn new(bbox: [f64; 4], label: &str) -> Self {
        Self {
            bbox,
            oriented: None,
            head: None,
            label: label.to_owned(),
        }
    }

    /// The mark for the same frame scaled by `factor`.
    pub fn scaled(self, factor: f64) -> Self {
        Self {
            bbox: self.bbox.map(|side| side * factor),
            oriented: self.oriented.map(|oriented| OrientedMark {
                cx: oriented.cx * factor,
                cy: oriented.cy * factor,
                width: oriented.width * factor,
                height: oriented.height * factor,
                angle_deg: oriented.angle_deg,
            }),
            head: self.head.map(|head| Head {
                cx: head.cx * factor,
                cy: head.cy * factor,
                radius: head.radius * factor,
            }),
            label: self.label,
        }
    }

    pub(super) fn is_drawable(&self) -> bool {
        let head = self.head.map(|head| [[head.cx, head.cy], [head.radius; 2]]);
        is_drawable(&self.aligned_corners())
            && self
                .oriented
                .is_none_or(|oriented| is_drawable(&oriented.corners()))
            && head.is_none_or(|head| is_drawable(&head))
    }

    pub(super) fn aligned_corners(&self) -> [[f64; 2]; 4] {
        let [left, top, right, bottom] = self.bbox;
        [[left, top], [right, top], [right, bottom], [left, bottom]]
    }

    /// The smallest rectangle around both boxes: left, top, right, bottom.
    pub(super) fn extent(&self) -> [f64; 4] {
        let oriented = self.oriented.map(|oriented| oriented.corners());
        let corners = oriented.into_iter().flatten();
        corners.fold(self.bbox, |[left, top, right, bottom], [x, y]| {
            [left.min(x), top.min(y), right.max(x), bottom.max(y)]
        })
    }
}

impl OrientedMark {
    pub(super) fn corners(&self) -> [[f64; 2]; 4] {
        let center = Pixel::new(self.cx, self.cy);
        let angle = self.angle_deg.to_radians();
        let corners = OrientedBox::turned(center, self.width, self.height, angle).corners();
        corners.map(|corner| [corner.x, corner.y])
    }
}
