//! Merging of overlapping boxes into one detection per person. Pure functions: no image, no I/O and
//! no other module of this crate.
//!
//! Boxes are corner-origin with continuous coordinates: pixel `i` covers `[i, i + 1)`. The pixel
//! space is part of the box type, so a box that was never mapped to the frame cannot be merged.

mod bbox;
mod candidate;
mod fusion;
mod overlap_grid;
mod refinement;
mod refinement_parameters;
mod suppression;

#[cfg(test)]
mod properties;

pub use bbox::{BBox, BBoxError, FramePixels, ViewPixels};
pub use candidate::{Candidate, MergedDetection};
pub use refinement::refine;
pub use refinement_parameters::{Refinement, RefinementParameters};
