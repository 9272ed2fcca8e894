//! Line plots of figures, as SVG or PNG.

mod draw;
mod precision_recall;

use plotters::{
    backend::{BitMapBackend, SVGBackend},
    drawing::{DrawingAreaErrorKind, IntoDrawingArea},
};

use crate::imaging::{
    Frame,
    annotate::{EncodeError, encode_png},
};

pub use precision_recall::precision_recall_plot;

/// Most lines that a plot can show so that they are told apart.
const MAX_LINES: usize = 64;
/// Pixels of the PNG per unit of the SVG.
const PNG_SCALE: u32 = 2;

/// A plot that cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum PlotError {
    /// There is too much to show.
    #[error("a plot of {0} lines shows nothing; choose at most {MAX_LINES}")]
    TooManyLines(usize),
    /// Our own fault.
    #[error("the plot could not be drawn: {0}")]
    Drawing(String),
    /// The picture cannot be written.
    #[error(transparent)]
    Encoding(#[from] EncodeError),
}

/// Lines over the unit square.
#[derive(Debug, Clone, PartialEq)]
pub struct LinePlot {
    /// What stands above.
    pub title: String,
    /// What the horizontal axis shows.
    pub x_name: String,
    /// What the vertical axis shows.
    pub y_name: String,
    /// The lines, in the order of the legend.
    pub lines: Vec<Line>,
}

/// One line of the legend.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// What the legend says.
    pub name: String,
    /// `[x, y]`, 0 to 1 each.
    pub points: Vec<[f64; 2]>,
    /// Drawn dashed in the same colour, without a name of its own.
    pub dashed: Vec<[f64; 2]>,
    /// Whether the points are marked.
    pub marked: bool,
}

impl LinePlot {
    /// The plot as an SVG document.
    ///
    /// # Errors
    /// [`PlotError`] when there are too many lines.
    pub fn svg(&self) -> Result<String, PlotError> {
        let mut svg = String::new();
        let size = self.size(1)?;
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        draw::draw(self, &area, 1).map_err(failed)?;
        drop(area);
        Ok(svg)
    }

    /// The plot as a PNG file.
    ///
    /// # Errors
    /// [`PlotError`] when there are too many lines.
    pub fn png(&self) -> Result<Vec<u8>, PlotError> {
        let (width, height) = self.size(PNG_SCALE)?;
        let mut pixels = vec![0; width as usize * height as usize * 3];
        let backend = BitMapBackend::with_buffer(&mut pixels, (width, height));
        let area = backend.into_drawing_area();
        draw::draw(self, &area, PNG_SCALE).map_err(failed)?;
        drop(area);
        let frame = Frame::new(width, height, pixels)
            .map_err(|error| PlotError::Drawing(error.to_string()))?;
        Ok(encode_png(&frame)?)
    }

    fn size(&self, scale: u32) -> Result<(u32, u32), PlotError> {
        if self.lines.len() > MAX_LINES {
            return Err(PlotError::TooManyLines(self.lines.len()));
        }
        let (width, height) = draw::size(self);
        Ok((width * scale, height * scale))
    }
}

#[expect(clippy::needless_pass_by_value, reason = "goes into `map_err`")]
fn failed<E: std::error::Error + Send + Sync>(error: DrawingAreaErrorKind<E>) -> PlotError {
    PlotError::Drawing(error.to_string())
}

#[cfg(test)]
mod tests;
