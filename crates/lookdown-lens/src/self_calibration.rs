//! A camera's lens and level from the straight edges of a room, and its height from people.
//!
//! Rooms have edges in three orthogonal directions. With the right lens, center and level, the
//! planes through the center of projection and nearly all edges contain one of those directions.
//! `docs/geometry.md` has the derivation.

mod camera;
mod camera_height;
mod evidence;
mod fit;
mod known_camera;
mod level_from_people;
mod maxima;
mod prior;
mod refusal;
mod search;
#[cfg(test)]
mod tests;
mod uncertainty;

pub use camera_height::{CameraHeight, HeightRefusal};
pub use evidence::EdgeCurve;
pub use fit::{CLEARLY_EXPLAINED, RoomFit};
pub use known_camera::{FieldOfView, FieldOfViewError, IdealLens, KnownCamera};
pub use level_from_people::LevelFromPeople;
pub use prior::CircleGuess;
pub use refusal::FitRefusal;
pub use uncertainty::FitUncertainty;
