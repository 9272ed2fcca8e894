//! Coarse signature of a frame for motion detection without any view.

use super::{
    Frame,
    cell_motion::{MOVED_LEVELS, MovedCell},
};

/// Most cells along the longer side of a frame: a person at the rim still fills a good part of one.
const MOST_CELLS: u32 = 64;
/// Shortest side of a cell, pixels: it averages out the noise of a sensor and of JPEG.
const MIN_CELL: u32 = 8;
/// Rows from one that is read to the next.
const ROW_STEP: usize = 2;

/// Mean levels (0 to 255) of the cells of a frame, for each color channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FrameSignature {
    cell: u32,
    across: usize,
    levels: Vec<[u8; 3]>,
}

impl FrameSignature {
    /// Computes the signature of a frame.
    pub fn new(frame: &Frame) -> Self {
        let longer = frame.width().max(frame.height());
        let cell = longer.div_ceil(MOST_CELLS).max(MIN_CELL);
        let across = frame.width().div_ceil(cell) as usize;
        let row_bytes = frame.width() as usize * 3;
        let mut levels = Vec::new();
        for rows in frame.pixels().chunks(row_bytes * cell as usize) {
            let mut sums = vec![([0_u32; 3], 0_u32); across];
            for row in rows.chunks_exact(row_bytes).step_by(ROW_STEP) {
                for ((sum, count), pixels) in sums.iter_mut().zip(row.chunks(3 * cell as usize)) {
                    for pixel in pixels.chunks_exact(3) {
                        for (sum, level) in sum.iter_mut().zip(pixel) {
                            *sum += u32::from(*level);
                        }
                        *count += 1;
                    }
                }
            }
            let means = sums.into_iter().map(|(sum, count)| {
                // A mean of levels is a level.
                sum.map(|sum| u8::try_from(sum / count.max(1)).unwrap_or(u8::MAX))
            });
            levels.extend(means);
        }
        Self {
            cell,
            across,
            levels,
        }
    }

    /// Returns the boxes `[x_min, y_min, x_max, y_max]` of all cells, corner-origin frame pixels.
    pub fn cells(&self) -> impl Iterator<Item = [f64; 4]> {
        (0..self.levels.len()).map(|index| self.cell(index))
    }

    /// Returns the cells of `visible` in which there is motion since an earlier frame of the same
    /// size. `None` for a frame of another size.
    pub fn moved_since(&self, earlier: &Self, visible: &[bool]) -> Option<Vec<MovedCell>> {
        let is_comparable = self.cell == earlier.cell
            && self.across == earlier.across
            && self.levels.len() == earlier.levels.len();
        let difference = |index: usize| {
            let pairs = self.levels[index].iter().zip(&earlier.levels[index]);
            pairs.map(|(a, b)| a.abs_diff(*b)).max().unwrap_or_default()
        };
        is_comparable.then(|| {
            let shown = (0..self.levels.len()).filter(|index| visible[*index]);
            let cells = shown.map(|index| MovedCell {
                bounds: self.cell(index),
                levels: difference(index),
            });
            cells.filter(|cell| cell.levels >= MOVED_LEVELS).collect()
        })
    }

    fn cell(&self, index: usize) -> [f64; 4] {
        let side = f64::from(self.cell);
        let (x, y) = ((index % self.across) as f64, (index / self.across) as f64);
        [x, y, x + 1.0, y + 1.0].map(|at| at * side)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame of one level with a square of 12 pixels of another.
    fn signature(level: u8, corner: [u32; 2], other: u8) -> FrameSignature {
        let (width, height) = (150, 100);
        let mut pixels = Vec::new();
        for y in 0..height {
            for x in 0..width {
                let is_within =
                    x >= corner[0] && x < corner[0] + 12 && y >= corner[1] && y < corner[1] + 12;
                pixels.extend([if is_within { other } else { level }; 3]);
            }
        }
        FrameSignature::new(&Frame::new(width, height, pixels).unwrap())
    }

    #[test]
    fn motion_is_found_where_it_is() {
        let (empty, person) = (signature(100, [0, 0], 100), signature(100, [70, 40], 160));
        let visible = vec![true; empty.cells().count()];
        let moved = person.moved_since(&empty, &visible).unwrap();
        assert!(!moved.is_empty());
        for MovedCell { bounds, levels } in moved {
            let [x_min, y_min, x_max, y_max] = bounds;
            assert!(levels > 4);
            assert!(x_max > 70.0 && x_min < 82.0 && y_max > 40.0 && y_min < 52.0);
        }
        let hidden = vec![false; visible.len()];
        assert_eq!(person.moved_since(&empty, &hidden), Some(Vec::new()));
    }

    #[test]
    fn a_flicker_of_the_light_moves_no_cell() {
        let (dark, light) = (signature(100, [0, 0], 100), signature(103, [0, 0], 103));
        let visible = vec![true; dark.cells().count()];
        assert_eq!(light.moved_since(&dark, &visible), Some(Vec::new()));
    }
}
