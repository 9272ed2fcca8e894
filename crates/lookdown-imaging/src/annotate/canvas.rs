//! Anti-aliased shapes. The coverage of a pixel follows from the distance of its center to the
//! shape.

use std::ops::Range;

use lookdown_lens::saturating::{to_u8, to_u32};

use crate::frame::Frame;

/// A color, 8 bits a channel.
pub(super) type Rgb = [u8; 3];

/// Mixes a color into one pixel. `opacity` ranges from 0 to 1.
pub(super) fn blend(frame: &mut Frame, x: u32, y: u32, color: Rgb, opacity: f64) {
    let start = 3 * (y as usize * frame.width() as usize + x as usize);
    let Some(pixel) = frame.pixels_mut().get_mut(start..start + 3) else {
        return;
    };
    for (value, target) in pixel.iter_mut().zip(color) {
        let mixed = f64::from(*value) + (f64::from(target) - f64::from(*value)) * opacity;
        // Adding 0.5 rounds; `round` is slower.
        *value = to_u8(mixed + 0.5);
    }
}

/// Pixels whose centers lie between two coordinates, clipped to `0..length`.
pub(super) fn pixels(from: f64, to: f64, length: u32) -> Range<u32> {
    let bound = |coordinate: f64| to_u32((coordinate - 0.5).ceil()).min(length);
    bound(from)..bound(to)
}

/// Straight lines with round ends and joints.
pub(super) struct Stroke<const EDGES: usize> {
    edges: [[[f64; 2]; 2]; EDGES],
    half_width: f64,
}

impl Stroke<1> {
    /// A line of `width` pixels between two points.
    pub(super) fn new(from: [f64; 2], to: [f64; 2], width: f64) -> Self {
        Self {
            edges: [[from, to]],
            half_width: width / 2.0,
        }
    }
}

impl Stroke<4> {
    /// An outline of `width` pixels along four corners.
    pub(super) fn around([a, b, c, d]: [[f64; 2]; 4], width: f64) -> Self {
        Self {
            edges: [[a, b], [b, c], [c, d], [d, a]],
            half_width: width / 2.0,
        }
    }
}

impl<const EDGES: usize> Stroke<EDGES> {
    /// Paints the lines, each pixel once, so that translucent lines stay even at their joints.
    /// Returns the number of painted pixels.
    pub(super) fn draw(&self, frame: &mut Frame, color: Rgb, opacity: f64) -> u64 {
        let mut painted_pixels = 0;
        let reach = self.half_width + 0.5;
        let rows = self.edges.as_flattened().iter().map(|end| end[1]);
        let top = rows.clone().fold(f64::INFINITY, f64::min) - reach;
        let bottom = rows.fold(f64::NEG_INFINITY, f64::max) + reach;
        for y in pixels(top, bottom, frame.height()) {
            let row = f64::from(y) + 0.5;
            let mut spans = self.edges.map(|edge| {
                let [from, to] = edge_span(edge, row, reach).unwrap_or_default();
                (pixels(from, to, frame.width()), edge)
            });
            spans.sort_unstable_by_key(|(span, _)| span.start);
            let mut painted = 0;
            for x in spans.iter().flat_map(|(span, _)| span.clone()) {
                if x >= painted {
                    painted = x + 1;
                    let point = [f64::from(x) + 0.5, row];
                    // Other edges are further away than their reach.
                    let distance = spans
                        .iter()
                        .filter(|(span, _)| span.contains(&x))
                        .map(|(_, edge)| squared_edge_distance(*edge, point))
                        .fold(f64::INFINITY, f64::min)
                        .sqrt();
                    let coverage = (reach - distance).clamp(0.0, 1.0);
                    blend(frame, x, y, color, opacity * coverage);
                    painted_pixels += 1;
                }
            }
        }
        painted_pixels
    }
}

/// The column range outside of which a row has no point within `reach` of an edge.
pub(super) fn edge_span([a, b]: [[f64; 2]; 2], row: f64, reach: f64) -> Option<[f64; 2]> {
    let [upper, lower] = if a[1] <= b[1] { [a, b] } else { [b, a] };
    let (from, to) = ((row - reach).max(upper[1]), (row + reach).min(lower[1]));
    if from > to {
        return None;
    }
    let drop = lower[1] - upper[1];
    let column = |y: f64| upper[0] + (lower[0] - upper[0]) * (y - upper[1]) / drop;
    let (first, last) = if drop > 0.0 {
        (column(from), column(to))
    } else {
        (upper[0], lower[0])
    };
    Some([first.min(last) - reach, first.max(last) + reach])
}

fn squared_edge_distance([a, b]: [[f64; 2]; 2], point: [f64; 2]) -> f64 {
    let (along, to_point) = (minus(b, a), minus(point, a));
    let squared_length = dot(along, along);
    let part = if squared_length > 0.0 {
        (dot(to_point, along) / squared_length).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let from_edge = [to_point[0] - part * along[0], to_point[1] - part * along[1]];
    dot(from_edge, from_edge)
}

fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// A filled rectangle with round corners.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plate {
    /// Column of the left side.
    pub left: f64,
    /// Row of the upper side.
    pub top: f64,
    /// Width in pixels.
    pub width: f64,
    /// Height in pixels.
    pub height: f64,
    /// Radius of the corners in pixels.
    pub radius: f64,
}

impl Plate {
    /// Paints the rectangle. Returns the number of painted pixels.
    pub(super) fn draw(&self, frame: &mut Frame, color: Rgb, opacity: f64) -> u64 {
        let mut painted_pixels = 0;
        let (right, bottom) = (self.left + self.width, self.top + self.height);
        let center = [self.left + self.width / 2.0, self.top + self.height / 2.0];
        let straight = [
            self.width / 2.0 - self.radius,
            self.height / 2.0 - self.radius,
        ];
        for y in pixels(self.top - 0.5, bottom + 0.5, frame.height()) {
            for x in pixels(self.left - 0.5, right + 0.5, frame.width()) {
                let from_corner = [
                    (f64::from(x) + 0.5 - center[0]).abs() - straight[0],
                    (f64::from(y) + 0.5 - center[1]).abs() - straight[1],
                ];
                let outside = from_corner[0].max(0.0).hypot(from_corner[1].max(0.0));
                let inside = from_corner[0].max(from_corner[1]).min(0.0);
                let coverage = 0.5 + self.radius - outside - inside;
                blend(frame, x, y, color, opacity * coverage.clamp(0.0, 1.0));
                painted_pixels += 1;
            }
        }
        painted_pixels
    }

    /// Left, top, right and bottom.
    pub(super) fn corners(&self) -> [f64; 4] {
        let (right, bottom) = (self.left + self.width, self.top + self.height);
        [self.left, self.top, right, bottom]
    }

    /// The area shared with the rectangle between two corners, in square pixels.
    pub(super) fn shared_area(&self, [left, top, right, bottom]: &[f64; 4]) -> f64 {
        let width = right.min(self.left + self.width) - left.max(self.left);
        let height = bottom.min(self.top + self.height) - top.max(self.top);
        width.max(0.0) * height.max(0.0)
    }
}
