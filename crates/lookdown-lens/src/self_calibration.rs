//! A camera's lens and level from the straight edges of a room.

mod camera;
mod edge_curve;
mod evidence;
mod search;
pub mod proto;

pub use edge_curve::EdgeCurve;
