//! Boxes, and how many overlapping boxes of the same person become one. Pure: no image, no I/O,
//! and nothing else of this crate.
//!
//! Boxes are corner-origin with continuous coordinates (pixel `i` covers `[i, i + 1)`); the space
//! they live in is part of their type, so a box that was never mapped to the frame cannot be
//! merged.

mod bbox;
mod candidate;
mod fusion;
mod overlap_grid;
mod refinement;
mod suppression;

#[cfg(test)]
mod properties;

pub use bbox::{BBox, BBoxError, FramePixels, ViewPixels};
pub use candidate::{Candidate, MergedDetection};
pub use refinement::{Refinement, RefinementParameters, refine};
