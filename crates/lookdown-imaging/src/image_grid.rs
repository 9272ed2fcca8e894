//! A grid of images with captions, as one image.

use super::{Frame, FrameError, annotate::text::Text};

const PAPER: u8 = 255;
const INK: [u8; 3] = [40, 44, 52];
/// Text height as a share of a cell's width.
const TEXT_SHARE: f64 = 0.055;
/// Margin around cells and lines, as a share of the text height.
const MARGIN_SHARE: f64 = 0.5;

/// Images of one size with labels for rows and columns.
#[derive(Debug, Clone)]
pub struct ImageGrid {
    /// Text line above the grid.
    pub title: String,
    /// Labels above the columns.
    pub columns: Vec<String>,
    /// The rows from top to bottom, each with the label at its left.
    pub rows: Vec<(String, Vec<GridCell>)>,
}

/// One image of the grid.
#[derive(Debug, Clone)]
pub struct GridCell {
    /// The image.
    pub image: Frame,
    /// Text below the image.
    pub caption: String,
}

impl ImageGrid {
    /// Draws the grid as one image. Every cell has the size of the largest image.
    ///
    /// # Errors
    /// [`FrameError`] when the size of the grid overflows.
    pub fn drawn(&self) -> Result<Frame, FrameError> {
        let layout = Layout::from_grid(self);
        let (width, height) = layout.size(self.columns.len(), self.rows.len());
        let bytes = width as usize * height as usize * 3;
        let mut sheet = Frame::new(width, height, vec![PAPER; bytes])?;
        let Layout { text, margin, .. } = &layout;
        text.write(&mut sheet, &self.title, [*margin, *margin], INK);
        for (column, name) in self.columns.iter().enumerate() {
            let (left, _) = layout.corner(0, column);
            let top = 2.0 * margin + text.height();
            text.write(&mut sheet, name, [f64::from(left), top], INK);
        }
        for (row, (name, cells)) in self.rows.iter().enumerate() {
            let (_, top) = layout.corner(row, 0);
            text.write(&mut sheet, name, [*margin, f64::from(top)], INK);
            for (column, cell) in cells.iter().enumerate() {
                let (left, top) = layout.corner(row, column);
                paste(&mut sheet, &cell.image, left, top);
                let below = f64::from(top + layout.cell_height) + margin / 2.0;
                text.write(&mut sheet, &cell.caption, [f64::from(left), below], INK);
            }
        }
        Ok(sheet)
    }
}

/// Positions of the cells and texts, in pixels.
struct Layout {
    text: Text,
    margin: f64,
    cell_height: u32,
    /// Left edge of the first column.
    left: u32,
    /// Top edge of the first row.
    top: u32,
    column_step: u32,
    row_step: u32,
}

impl Layout {
    fn from_grid(grid: &ImageGrid) -> Self {
        let cells = || grid.rows.iter().flat_map(|(_, cells)| cells);
        let widths = cells().map(|cell| cell.image.width());
        let heights = cells().map(|cell| cell.image.height());
        let (cell_width, cell_height) = (widths.max().unwrap_or(1), heights.max().unwrap_or(1));
        let text = Text::new((f64::from(cell_width) * TEXT_SHARE).max(12.0));
        let margin = text.height() * MARGIN_SHARE;
        let names = grid.rows.iter().map(|(name, _)| text.width(name));
        let widest_name = names.fold(0.0, f64::max);
        Self {
            left: whole(widest_name + 2.0 * margin),
            top: whole(3.0 * margin + 2.0 * text.height()),
            column_step: cell_width + whole(margin),
            row_step: cell_height + whole(2.0 * margin + text.height()),
            text,
            margin,
            cell_height,
        }
    }

    fn corner(&self, row: usize, column: usize) -> (u32, u32) {
        let times = |count: usize, step: u32| {
            u32::try_from(count)
                .unwrap_or(u32::MAX)
                .saturating_mul(step)
        };
        (
            self.left.saturating_add(times(column, self.column_step)),
            self.top.saturating_add(times(row, self.row_step)),
        )
    }

    fn size(&self, columns: usize, rows: usize) -> (u32, u32) {
        self.corner(rows, columns)
    }
}

fn whole(pixels: f64) -> u32 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a few hundred pixels"
    )]
    {
        pixels.ceil() as u32
    }
}

fn paste(sheet: &mut Frame, image: &Frame, left: u32, top: u32) {
    let stride = sheet.width() as usize * 3;
    let bytes = image.width() as usize * 3;
    let rows = image.pixels().chunks_exact(bytes);
    let start = top as usize * stride + left as usize * 3;
    let lines = sheet.pixels_mut()[start..].chunks_mut(stride);
    for (row, line) in rows.zip(lines) {
        line[..bytes].copy_from_slice(row);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(value: u8, width: u32) -> GridCell {
        GridCell {
            image: Frame::new(width, 40, vec![value; width as usize * 40 * 3]).unwrap(),
            caption: "3 boxes".to_owned(),
        }
    }

    /// Number of pixels of one gray level.
    fn count(sheet: &Frame, value: u8) -> usize {
        let pixels = sheet.pixels().chunks_exact(3);
        pixels.filter(|pixel| *pixel == [value; 3]).count()
    }

    #[test]
    fn every_image_is_complete_and_in_its_row_and_column() {
        let grid = ImageGrid {
            title: "title".to_owned(),
            columns: vec!["a".to_owned(), "b".to_owned()],
            rows: vec![
                ("one".to_owned(), vec![cell(90, 60), cell(91, 60)]),
                ("two".to_owned(), vec![cell(92, 60), cell(93, 30)]),
            ],
        };
        let sheet = grid.drawn().unwrap();
        let expected = [(90, 60), (91, 60), (92, 60), (93, 30)];
        for (value, width) in expected {
            assert_eq!(count(&sheet, value), width * 40, "{value}");
        }
        let first = |value: u8| {
            let mut pixels = sheet.pixels().chunks_exact(3);
            let index = pixels.position(|pixel| pixel == [value; 3]).unwrap();
            let width = sheet.width() as usize;
            (index % width, index / width)
        };
        assert_eq!((first(90).1, first(90).0), (first(91).1, first(92).0));
        assert!(first(91).0 > first(90).0 + 60 && first(92).1 > first(90).1 + 40);
    }

    #[test]
    fn a_grid_of_nothing_is_drawn() {
        let grid = ImageGrid {
            title: String::new(),
            columns: Vec::new(),
            rows: Vec::new(),
        };
        assert!(grid.drawn().is_ok());
    }
}
