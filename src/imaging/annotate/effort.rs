//! The bound on the work of one drawing: painted pixels, and a check that the result is still wanted.

/// Most painted pixels per pixel of the frame. Where lines cover a frame twice, nothing below them can
/// be seen, so that what is drawn later would not help either.
const MAX_PAINTED_PER_PIXEL: u64 = 2;
/// Small frames may be painted more often, because that costs nothing.
const MIN_BUDGET_PIXELS: u64 = 2_000_000;

/// A drawing was given up because its result is no longer wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the drawing was given up because the client no longer waits for it")]
pub struct Cancelled;

/// Counts the work of one drawing.
pub(super) struct Effort<'a> {
    is_cancelled: &'a dyn Fn() -> bool,
    pixels_left: u64,
}

impl<'a> Effort<'a> {
    /// The work that a frame of so many pixels may cost.
    pub(super) fn new(width: u32, height: u32, is_cancelled: &'a dyn Fn() -> bool) -> Self {
        let pixels = u64::from(width) * u64::from(height);
        Self {
            is_cancelled,
            pixels_left: (MAX_PAINTED_PER_PIXEL * pixels).max(MIN_BUDGET_PIXELS),
        }
    }

    /// Returns whether the next shape may be drawn.
    ///
    /// # Errors
    /// [`Cancelled`] when the result is no longer wanted.
    pub(super) fn allows_more(&self) -> Result<bool, Cancelled> {
        if (self.is_cancelled)() {
            return Err(Cancelled);
        }
        Ok(self.pixels_left > 0)
    }

    /// Subtracts the pixels of a shape.
    pub(super) fn spend(&mut self, painted_pixels: u64) {
        self.pixels_left = self.pixels_left.saturating_sub(painted_pixels);
    }
}
