//! Bound on the work of one drawing: a budget of painted pixels and a cancellation check.

/// Most painted pixels per pixel of the frame. Where lines cover a frame twice, it is unreadable,
/// and further shapes would not help.
const MAX_PAINTED_PER_PIXEL: u64 = 2;
/// Most painted pixels of small frames, which cost little.
const MIN_BUDGET_PIXELS: u64 = 2_000_000;
/// Most painted pixels of any frame, so that drawing takes less time than decoding. The outlines of
/// a hundred persons in a frame of 50 megapixels are fewer.
const MAX_BUDGET_PIXELS: u64 = 8_000_000;

/// A drawing was cancelled because its result is no longer needed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the drawing was cancelled because the client no longer waits for it")]
pub struct Cancelled;

/// Counts the painted pixels of one drawing.
pub(super) struct Effort<'a> {
    is_cancelled: &'a dyn Fn() -> bool,
    pixels_left: u64,
}

impl<'a> Effort<'a> {
    /// The budget for a frame of `width` × `height` pixels.
    pub(super) fn new(width: u32, height: u32, is_cancelled: &'a dyn Fn() -> bool) -> Self {
        let pixels = u64::from(width) * u64::from(height);
        Self {
            is_cancelled,
            pixels_left: (MAX_PAINTED_PER_PIXEL * pixels)
                .clamp(MIN_BUDGET_PIXELS, MAX_BUDGET_PIXELS),
        }
    }

    /// Returns true if the next shape may be drawn.
    ///
    /// # Errors
    /// [`Cancelled`] when the result is no longer needed.
    pub(super) fn allows_more(&self) -> Result<bool, Cancelled> {
        if (self.is_cancelled)() {
            return Err(Cancelled);
        }
        Ok(self.pixels_left > 0)
    }

    /// Subtracts the painted pixels of a shape from the budget.
    pub(super) fn spend(&mut self, painted_pixels: u64) {
        self.pixels_left = self.pixels_left.saturating_sub(painted_pixels);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_frames_have_no_larger_budget_than_8_million_pixels() {
        let budget = |width, height| Effort::new(width, height, &|| false).pixels_left;
        assert_eq!(budget(100, 100), 2_000_000);
        assert_eq!(budget(2000, 2000), 8_000_000);
        assert_eq!(budget(8192, 6100), 8_000_000);
    }
}
