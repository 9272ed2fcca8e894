//! Conceals persons in a frame: each pixel of the boxes along them is replaced by the mean color
//! of its surroundings or by one color.
//!
//! Concealing is not limited by the budget of drawings, because a person must not stay visible in a
//! crowded frame. Its work is one read of the frame, and one write of each concealed pixel.

use std::ops::Range;

use lookdown_lens::saturating::to_u32;

use super::{
    canvas::{Rgb, edge_span, pixels},
    effort::Cancelled,
    mark::Mark,
};
use crate::frame::Frame;

/// The replacement of concealed pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Concealment {
    /// The mean color of areas as large as a person is wide.
    Blur,
    /// One color.
    Silhouette,
}

const SILHOUETTE: Rgb = [96, 96, 96];
/// Concealed area, as a multiple of the sides of the box: boxes may cut off feet and hands.
const MARGIN: f64 = 1.3;
/// Smallest side of the areas of mean color, pixels.
const MIN_BLOCK: u32 = 16;
/// Rows between two cancellation checks.
const ROWS_PER_CHECK: u32 = 64;

/// Conceals the marked persons.
///
/// # Errors
/// [`Cancelled`] as soon as `is_cancelled` returns true. The frame is then partly concealed.
pub fn conceal(
    frame: &mut Frame,
    marks: &[Mark],
    concealment: Concealment,
    is_cancelled: &dyn Fn() -> bool,
) -> Result<(), Cancelled> {
    let mut areas: Vec<_> = marks.iter().map(|mark| Area::new(mark, frame)).collect();
    areas.sort_unstable_by_key(|area| area.rows.start);
    let Some(block) = areas.iter().map(|area| area.side).reduce(u32::max) else {
        return Ok(());
    };
    let means = match concealment {
        Concealment::Blur => Some(BlockMeans::new(frame, block)),
        Concealment::Silhouette => None,
    };
    let (width, height) = (frame.width(), frame.height());
    let mut waiting = areas.iter().peekable();
    let mut active: Vec<&Area> = Vec::new();
    for y in 0..height {
        if y % ROWS_PER_CHECK == 0 && is_cancelled() {
            return Err(Cancelled);
        }
        while let Some(area) = waiting.next_if(|area| area.rows.start <= y) {
            active.push(area);
        }
        active.retain(|area| area.rows.end > y);
        let mut spans: Vec<_> = active.iter().map(|area| area.span(y, width)).collect();
        spans.sort_unstable_by_key(|span| span.start);
        let row = &mut frame.pixels_mut()[3 * (y * width) as usize..][..3 * width as usize];
        let mut done = 0;
        for span in spans {
            for x in span.start.max(done)..span.end {
                let color = means.as_ref().map_or(SILHOUETTE, |means| means.at(x, y));
                row[3 * x as usize..][..3].copy_from_slice(&color);
            }
            done = done.max(span.end);
        }
    }
    Ok(())
}

/// A concealed quadrilateral.
struct Area {
    corners: [[f64; 2]; 4],
    rows: Range<u32>,
    /// Its shorter side, pixels.
    side: u32,
}

impl Area {
    fn new(mark: &Mark, frame: &Frame) -> Self {
        let corners = mark.oriented.map(|oriented| oriented.corners());
        let corners = corners.unwrap_or_else(|| mark.aligned_corners());
        let sum = |axis: usize| corners.iter().map(|corner| corner[axis]).sum::<f64>();
        let center = [sum(0) / 4.0, sum(1) / 4.0];
        let corners = corners.map(|[x, y]| {
            [
                center[0] + MARGIN * (x - center[0]),
                center[1] + MARGIN * (y - center[1]),
            ]
        });
        let [top, bottom] = bounds(corners.map(|corner| corner[1]));
        let length = |from: [f64; 2], to: [f64; 2]| (from[0] - to[0]).hypot(from[1] - to[1]);
        let sides = [
            length(corners[0], corners[1]),
            length(corners[1], corners[2]),
        ];
        let longest = frame.width().max(frame.height());
        // A mark with a coordinate that is not finite conceals nothing.
        let side = bounds(sides)[0].clamp(0.0, longest.into());
        Self {
            corners,
            rows: pixels(top - 0.5, bottom + 0.5, frame.height()),
            side: to_u32(side.ceil()).max(MIN_BLOCK),
        }
    }

    /// The columns that it touches in a row.
    fn span(&self, y: u32, width: u32) -> Range<u32> {
        let corners = self.corners;
        let edges = [0, 1, 2, 3].map(|index| [corners[index], corners[(index + 1) % 4]]);
        let spans = edges.map(|edge| edge_span(edge, f64::from(y) + 0.5, 0.5));
        let [left, right] = bounds_of(spans.into_iter().flatten());
        let span = pixels(left, right, width);
        span.start..span.end.max(span.start)
    }
}

fn bounds<const N: usize>(values: [f64; N]) -> [f64; 2] {
    bounds_of(values.into_iter().map(|value| [value, value]))
}

/// The least and the greatest end of ranges.
fn bounds_of(ranges: impl Iterator<Item = [f64; 2]>) -> [f64; 2] {
    ranges.fold(
        [f64::INFINITY, f64::NEG_INFINITY],
        |[least, most], [from, to]| [least.min(from), most.max(to)],
    )
}

/// The mean colors of square blocks of a frame.
struct BlockMeans {
    side: u32,
    columns: u32,
    rows: u32,
    means: Vec<Rgb>,
}

impl BlockMeans {
    fn new(frame: &Frame, side: u32) -> Self {
        let (columns, rows) = (frame.width().div_ceil(side), frame.height().div_ceil(side));
        let mut means = Vec::with_capacity((columns * rows) as usize);
        let row_bytes = 3 * frame.width() as usize;
        let mut lines = frame.pixels().chunks_exact(row_bytes);
        for _ in 0..rows {
            let mut sums = vec![[0_u64; 4]; columns as usize];
            for line in lines.by_ref().take(side as usize) {
                for (sum, block) in sums.iter_mut().zip(line.chunks(3 * side as usize)) {
                    for pixel in block.chunks_exact(3) {
                        for (channel, value) in sum.iter_mut().zip(pixel) {
                            *channel += u64::from(*value);
                        }
                        sum[3] += 1;
                    }
                }
            }
            let mean = |[red, green, blue, count]: [u64; 4]| {
                // The mean of bytes is a byte.
                [red, green, blue].map(|sum| u8::try_from(sum / count.max(1)).unwrap_or(u8::MAX))
            };
            means.extend(sums.into_iter().map(mean));
        }
        Self {
            side,
            columns,
            rows,
            means,
        }
    }

    /// The color at a pixel, between those of the four nearest blocks.
    fn at(&self, x: u32, y: u32) -> Rgb {
        let (column, across) = self.position(x, self.columns);
        let (row, down) = self.position(y, self.rows);
        let mean = |column: u32, row: u32| {
            let index = row.min(self.rows - 1) * self.columns + column.min(self.columns - 1);
            self.means
                .get(index as usize)
                .copied()
                .unwrap_or(SILHOUETTE)
        };
        let (above, below) = (
            mix(mean(column, row), mean(column + 1, row), across, self.side),
            mix(
                mean(column, row + 1),
                mean(column + 1, row + 1),
                across,
                self.side,
            ),
        );
        mix(above, below, down, self.side)
    }

    /// The block whose center is before a position, and the distance from that center.
    fn position(&self, at: u32, count: u32) -> (u32, u32) {
        let half = self.side / 2;
        if at < half {
            return (0, 0);
        }
        let (block, rest) = ((at - half) / self.side, (at - half) % self.side);
        if block + 1 < count {
            (block, rest)
        } else {
            (count - 1, 0)
        }
    }
}

/// The color `part` of `whole` on the way from one to the other.
fn mix(from: Rgb, to: Rgb, part: u32, whole: u32) -> Rgb {
    std::array::from_fn(|channel| {
        let sum = u32::from(from[channel]) * (whole - part) + u32::from(to[channel]) * part;
        u8::try_from(sum / whole.max(1)).unwrap_or(u8::MAX)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::annotate::OrientedMark;

    /// Columns of two colors, which no mean has.
    fn stripes(side: u32) -> Frame {
        let pixels = (0..side * side).flat_map(|index| [if index % 2 == 0 { 0 } else { 255 }; 3]);
        Frame::new(side, side, pixels.collect()).unwrap()
    }

    fn person(cx: f64, cy: f64, angle_deg: f64) -> Mark {
        Mark {
            bbox: [cx - 10.0, cy - 10.0, cx + 10.0, cy + 10.0],
            oriented: Some(OrientedMark {
                cx,
                cy,
                width: 20.0,
                height: 60.0,
                angle_deg,
            }),
            head: None,
            label: String::new(),
        }
    }

    #[test]
    fn every_pixel_of_a_turned_box_is_concealed_and_no_other() {
        for concealment in [Concealment::Blur, Concealment::Silhouette] {
            for angle in [0.0, 30.0, 45.0, 90.0, 160.0] {
                let original = stripes(200);
                let mut frame = original.clone();
                conceal(
                    &mut frame,
                    &[person(100.0, 90.0, angle)],
                    concealment,
                    &|| false,
                )
                .unwrap();
                let (sin, cos) = angle.to_radians().sin_cos();
                for (x, y) in (0..200).flat_map(|y| (0..200).map(move |x| (x, y))) {
                    let (dx, dy) = (f64::from(x) + 0.5 - 100.0, f64::from(y) + 0.5 - 90.0);
                    let across = (dx * cos + dy * sin).abs() - MARGIN * 10.0;
                    let along = (dx * sin - dy * cos).abs() - MARGIN * 30.0;
                    let is_changed = frame.pixel(x, y) != original.pixel(x, y);
                    if across.max(along) < 0.0 {
                        assert!(is_changed, "({x}, {y}) at {angle}°");
                    } else if across.max(along) > 1.5 {
                        assert!(!is_changed, "({x}, {y}) at {angle}°");
                    }
                }
            }
        }
    }

    #[test]
    fn crowds_beyond_the_budget_of_drawings_are_concealed() {
        let original = stripes(300);
        let mut frame = original.clone();
        let marks: Vec<_> = (0..5000)
            .map(|index| person(f64::from(index % 300), 150.0, 0.0))
            .collect();
        conceal(&mut frame, &marks, Concealment::Silhouette, &|| false).unwrap();
        assert!((0..300).all(|x| frame.pixel(x, 150) == SILHOUETTE));
        assert_eq!(frame.pixel(5, 5), original.pixel(5, 5));
    }

    #[test]
    fn marks_at_and_beyond_the_border_are_cut_off() {
        let mut frame = stripes(50);
        let marks = [
            person(0.0, 0.0, 45.0),
            person(49.0, 60.0, 0.0),
            person(-500.0, 900.0, 10.0),
        ];
        for concealment in [Concealment::Blur, Concealment::Silhouette] {
            conceal(&mut frame, &marks, concealment, &|| false).unwrap();
        }
        assert_eq!(frame.pixel(0, 0), SILHOUETTE);
        assert_eq!(
            conceal(&mut frame, &marks, Concealment::Blur, &|| true),
            Err(Cancelled)
        );
    }
}
