//! Line plots of figures, as SVG or PNG.

mod draw;
mod line_plot;
mod precision_recall;

use lookdown_imaging::{
    Frame,
    annotate::{EncodeError, encode_png},
};
use plotters::{
    backend::{BitMapBackend, SVGBackend},
    drawing::{DrawingAreaErrorKind, IntoDrawingArea},
};

pub use line_plot::{Line, LinePlot};
pub use precision_recall::precision_recall_plot;

/// Most lines that can be distinguished in a plot.
const MAX_LINES: usize = 64;
/// Pixels of the PNG per unit of the SVG.
const PNG_SCALE: u32 = 2;

/// The reason why a plot cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum PlotError {
    /// There are too many lines.
    #[error("a plot of {0} lines is unreadable; choose at most {MAX_LINES}")]
    TooManyLines(usize),
    /// An internal error.
    #[error("the plot could not be drawn: {0}")]
    Drawing(String),
    /// The image cannot be encoded.
    #[error(transparent)]
    Encoding(#[from] EncodeError),
}

impl LinePlot {
    /// Returns the plot as an SVG document.
    ///
    /// # Errors
    /// [`PlotError`] if there are too many lines.
    pub fn svg(&self) -> Result<String, PlotError> {
        let mut svg = String::new();
        let size = self.size(1)?;
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        draw::draw(self, &area, 1).map_err(failed)?;
        drop(area);
        Ok(svg)
    }

    /// Returns the plot as a PNG file.
    ///
    /// # Errors
    /// [`PlotError`] if there are too many lines.
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

#[expect(clippy::needless_pass_by_value, reason = "passed to `map_err`")]
fn failed<E: std::error::Error + Send + Sync>(error: DrawingAreaErrorKind<E>) -> PlotError {
    PlotError::Drawing(error.to_string())
}

#[cfg(test)]
mod tests;
