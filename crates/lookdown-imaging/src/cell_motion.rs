//! Motion and noise in the mean levels of cells, for frames and for views.

/// Least change of a cell's mean, in gray levels (0 to 255), that counts as motion. The noise of a
/// mean is below 1.
pub(super) const MOVED_LEVELS: u8 = 4;
/// Least change of a cell's mean by a person who was not there. Clothes differ from the floor by
/// tens, parted ends of shadows by less than this.
pub const NEW_LEVELS: u8 = 10;
/// Most cells that noise of a video encoder changes, each by less than `NEW_LEVELS` and none beside
/// another one.
const MAX_NOISY_CELLS: usize = 8;

/// A cell with motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MovedCell {
    /// The box `[x_min, y_min, x_max, y_max]`, corner-origin pixels of the frame or the view.
    pub bounds: [f64; 4],
    /// The greatest change of a mean level.
    pub levels: u8,
}

impl MovedCell {
    /// Returns true if the cells have a side or a corner in common.
    fn touches(&self, other: &Self) -> bool {
        let (one, other) = (&self.bounds, &other.bounds);
        let is_within = |axis: usize| one[axis] <= other[axis + 2] && other[axis] <= one[axis + 2];
        is_within(0) && is_within(1)
    }
}

/// Returns true if cells with motion are few, weak and apart from each other, as those that the
/// noise of a video encoder changes.
pub fn is_noise(moved: &[MovedCell]) -> bool {
    let is_apart = |(index, cell): (usize, &MovedCell)| {
        let mut others = moved.iter().skip(index + 1);
        cell.levels < NEW_LEVELS && !others.any(|other| cell.touches(other))
    };
    moved.len() <= MAX_NOISY_CELLS && moved.iter().enumerate().all(is_apart)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(x: f64, y: f64, levels: u8) -> MovedCell {
        MovedCell {
            bounds: [x, y, x + 15.0, y + 15.0],
            levels,
        }
    }

    #[test]
    fn weak_cells_apart_from_each_other_are_noise() {
        assert!(is_noise(&[]));
        let apart = [
            cell(0.0, 0.0, 4),
            cell(30.0, 0.0, 5),
            cell(300.0, 0.0, 4),
            cell(0.0, 30.0, 4),
        ];
        assert!(is_noise(&apart));
        assert!(!is_noise(&[cell(0.0, 0.0, 4), cell(15.0, 0.0, 4)]));
        assert!(!is_noise(&[cell(0.0, 15.0, 4), cell(15.0, 0.0, 4)]));
        assert!(!is_noise(&[cell(0.0, 0.0, NEW_LEVELS)]));
        let many = (0..9).map(|index| cell(f64::from(index) * 30.0, 0.0, 4));
        assert!(!is_noise(&many.collect::<Vec<_>>()));
    }
}
