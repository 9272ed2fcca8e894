//! Text rendering with the embedded font.

use ab_glyph::{Font, FontRef, PxScale, ScaleFont, point};

use super::canvas::{Rgb, blend, pixels};
use crate::frame::Frame;

/// Glyphs of one size.
pub(crate) struct Text {
    font: FontRef<'static>,
    scale: PxScale,
}

impl Text {
    /// Glyphs `height` pixels high, from the lowest to the highest point.
    pub(crate) fn new(height: f64) -> Self {
        #[expect(clippy::expect_used, reason = "the font is part of the program")]
        let font = FontRef::try_from_slice(epaint_default_fonts::HACK_REGULAR)
            .expect("the embedded font is valid");
        #[expect(clippy::cast_possible_truncation, reason = "a size in pixels")]
        let scale = PxScale::from(height as f32);
        Self { font, scale }
    }

    /// Height of a line, pixels.
    pub(crate) fn height(&self) -> f64 {
        f64::from(self.scale.y)
    }

    /// Width of a text, pixels.
    pub(crate) fn width(&self, text: &str) -> f64 {
        let font = self.font.as_scaled(self.scale);
        let advance = |letter| font.h_advance(font.glyph_id(letter));
        f64::from(text.chars().map(advance).sum::<f32>())
    }

    /// Writes one line with its upper left corner at `[left, top]`. Parts outside the frame are cut
    /// off. Returns the number of painted pixels.
    #[expect(clippy::cast_possible_truncation, reason = "positions in a frame")]
    pub(crate) fn write(
        &self,
        frame: &mut Frame,
        text: &str,
        [left, top]: [f64; 2],
        ink: Rgb,
    ) -> u64 {
        let mut painted_pixels = 0;
        let font = self.font.as_scaled(self.scale);
        let mut pen = point(left as f32, top as f32 + font.ascent());
        for letter in text.chars() {
            let glyph = font.glyph_id(letter);
            let placed = glyph.with_scale_and_position(self.scale, pen);
            pen.x += font.h_advance(glyph);
            let Some(outline) = self.font.outline_glyph(placed) else {
                continue;
            };
            let corner = outline.px_bounds().min;
            outline.draw(|x, y, coverage| {
                let column = f64::from(corner.x) + f64::from(x);
                let row = f64::from(corner.y) + f64::from(y);
                for y in pixels(row, row + 1.0, frame.height()) {
                    for x in pixels(column, column + 1.0, frame.width()) {
                        blend(frame, x, y, ink, f64::from(coverage.min(1.0)));
                        painted_pixels += 1;
                    }
                }
            });
        }
        painted_pixels
    }
}
