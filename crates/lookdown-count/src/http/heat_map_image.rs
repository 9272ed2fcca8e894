//! The colors of heat maps, and their images as PNG.

use axum::{
    http::header::CONTENT_TYPE,
    response::{IntoResponse, Response},
};
use lookdown_http::problem::Problem;
use lookdown_lens::saturating::to_u8;

/// Pixels of a cell.
const CELL_PX: usize = 8;

/// Draws rows of seconds: transparent without presence, from blue to red with the logarithm of the
/// time.
pub(super) fn draw(seconds: &[Vec<f64>]) -> Result<Response, Problem> {
    let columns = seconds.first().map_or(1, Vec::len);
    let rows = seconds.len().max(1);
    let most = seconds.iter().flatten().copied().fold(0.0, f64::max);
    let mut pixels = vec![0; columns * rows * CELL_PX * CELL_PX * 4];
    let width = columns * CELL_PX;
    for (row, cells) in seconds.iter().enumerate() {
        for (column, seconds) in cells.iter().enumerate() {
            let color = color(*seconds, most);
            for y in row * CELL_PX..(row + 1) * CELL_PX {
                let start = (y * width + column * CELL_PX) * 4;
                for pixel in pixels[start..start + CELL_PX * 4].chunks_exact_mut(4) {
                    pixel.copy_from_slice(&color);
                }
            }
        }
    }
    image(&pixels, width, rows * CELL_PX)
}

/// Returns pixels with red, green, blue and alpha as a PNG.
pub(super) fn image(pixels: &[u8], width: usize, height: usize) -> Result<Response, Problem> {
    let file = encoded(pixels, width, height).map_err(|problem| {
        tracing::error!("the heat map cannot be encoded: {problem}");
        Problem::internal()
    })?;
    Ok(([(CONTENT_TYPE, "image/png")], file).into_response())
}

fn encoded(pixels: &[u8], width: usize, height: usize) -> Result<Vec<u8>, png::EncodingError> {
    let mut file = Vec::new();
    let side = |pixels: usize| u32::try_from(pixels).unwrap_or(u32::MAX);
    let mut encoder = png::Encoder::new(&mut file, side(width), side(height));
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(pixels)?;
    Ok(file)
}

/// Returns the color of a time of presence, with the most of any cell.
pub(super) fn color(seconds: f64, most: f64) -> [u8; 4] {
    if seconds <= 0.0 {
        return [0; 4];
    }
    let share = (1.0 + seconds).ln() / (1.0 + most).ln();
    let channel = |value: f64| to_u8((value * 255.0).round());
    [
        channel(2.0 * share - 0.6),
        channel(1.2 - (2.4 * share - 1.2).abs()),
        channel(1.0 - 1.6 * share),
        channel(0.35 + 0.5 * share),
    ]
}
