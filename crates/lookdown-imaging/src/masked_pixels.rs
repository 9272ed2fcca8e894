//! Privacy masks: the pixels under polygons, computed once per frame size and then blanked in each
//! frame.

use std::ops::Range;

use lookdown_lens::{
    geometry::{
        Pixel, Polygon,
        pixels::to_corner_origin,
        polygon::{Edge, crossing},
    },
    saturating::to_u32,
};

use super::Frame;

/// The pixels that masks cover, wholly or in part.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct MaskedPixels {
    /// Masked columns of each row, as ranges from left to right with gaps in between. Empty without
    /// masks.
    rows: Vec<Box<[Range<u32>]>>,
}

impl MaskedPixels {
    /// Computes the pixels under `masks` (corner-origin pixels) in frames of `width` × `height`
    /// pixels.
    pub fn new(masks: &[Polygon], width: u32, height: u32) -> Self {
        if masks.is_empty() {
            return Self::default();
        }
        let row = |y| {
            let spans = masks.iter().flat_map(|mask| touched(mask, y, width));
            joined(spans.collect())
        };
        Self {
            rows: (0..height).map(row).collect(),
        }
    }

    /// Returns true without masks.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Number of masked pixels.
    pub fn count(&self) -> u64 {
        let spans = self.rows.iter().flatten();
        spans.map(|span| u64::from(span.end - span.start)).sum()
    }

    /// Returns true if the pixel in column `x` and row `y` is masked. Pixels outside the frame are
    /// not.
    pub fn hides(&self, x: u32, y: u32) -> bool {
        let Some(row) = self.rows.get(y as usize) else {
            return false;
        };
        let following = row.partition_point(|span| span.start <= x);
        following > 0 && x < row[following - 1].end
    }

    /// Returns true if the pixel that contains a position (pixel centers) is masked.
    pub fn hides_position(&self, position: Pixel) -> bool {
        let position = to_corner_origin(position);
        position.x >= 0.0
            && position.y >= 0.0
            && self.hides(to_u32(position.x.floor()), to_u32(position.y.floor()))
    }

    /// Makes the masked pixels black in a frame of the same size.
    pub fn blank(&self, frame: &mut Frame) {
        let row_bytes = 3 * frame.width() as usize;
        let lines = frame.pixels_mut().chunks_exact_mut(row_bytes);
        for (line, row) in lines.zip(&self.rows) {
            for span in row {
                line[3 * span.start as usize..3 * span.end as usize].fill(0);
            }
        }
    }

    /// Memory held, bytes.
    pub fn bytes(&self) -> usize {
        let rows = self.rows.iter().map(|row| size_of_val(&**row));
        size_of_val(self.rows.as_slice()) + rows.sum::<usize>()
    }
}

/// The columns in which a polygon covers a part of the row `y`: where its center line is inside,
/// and where an edge crosses it.
fn touched(polygon: &Polygon, y: u32, width: u32) -> Vec<Range<u32>> {
    let [top, middle, bottom] = [0.0, 0.5, 1.0].map(|down| f64::from(y) + down);
    let mut crossings: Vec<f64> = polygon
        .edges()
        .filter_map(|edge| crossing(edge, middle))
        .collect();
    crossings.sort_unstable_by(f64::total_cmp);
    let inside = crossings
        .chunks_exact(2)
        .map(|pair| columns(pair[0], pair[1], width));
    let along = polygon.edges().filter_map(|edge| extent(edge, top, bottom));
    let along = along.map(|[left, right]| columns(left, right, width));
    inside.chain(along).collect()
}

/// The horizontal extent of an edge between two heights, or `None` if it does not cross them.
fn extent([a, b]: Edge, top: f64, bottom: f64) -> Option<[f64; 2]> {
    let [upper, lower] = if a.y <= b.y { [a, b] } else { [b, a] };
    if lower.y <= top || upper.y >= bottom {
        return None;
    }
    let at = |y: f64| {
        let share = (y - upper.y) / (lower.y - upper.y);
        upper.x + (lower.x - upper.x) * share
    };
    let first = if upper.y < top { at(top) } else { upper.x };
    let last = if lower.y > bottom {
        at(bottom)
    } else {
        lower.x
    };
    Some([first.min(last), first.max(last)])
}

/// The columns that lie between two positions or contain one of them, clipped to the frame.
fn columns(left: f64, right: f64, width: u32) -> Range<u32> {
    to_u32(left.floor()).min(width)..to_u32(right.ceil()).min(width)
}

/// Merges overlapping spans and sorts them from left to right.
fn joined(mut spans: Vec<Range<u32>>) -> Box<[Range<u32>]> {
    spans.retain(|span| !span.is_empty());
    spans.sort_unstable_by_key(|span| span.start);
    let mut joined: Vec<Range<u32>> = Vec::new();
    for span in spans {
        match joined.last_mut() {
            Some(last) if span.start <= last.end => last.end = last.end.max(span.end),
            _ => joined.push(span),
        }
    }
    joined.into_boxed_slice()
}

#[cfg(test)]
mod tests;
