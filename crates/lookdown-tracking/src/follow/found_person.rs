//! A person that was found in a frame.

use lookdown_lens::geometry::OrientedBox;

/// A person that was found in a frame.
pub trait FoundPerson: Clone {
    /// The box `[x_min, y_min, x_max, y_max]`, corner-origin frame pixels.
    fn bounds(&self) -> [f64; 4];
    /// The oriented box in the frame.
    fn oriented_box(&self) -> OrientedBox;
    /// The score, a probability.
    fn score(&self) -> f64;
    /// Returns the person with another score.
    fn with_score(self, score: f64) -> Self;
}
