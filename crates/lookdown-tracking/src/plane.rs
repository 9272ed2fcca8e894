//! The planes of lines and zones.

use serde::{Deserialize, Serialize};

/// The plane in which a line or zone is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Plane {
    /// Meters on the floor of the site, or of the camera where it is alone.
    FloorM,
    /// Corner-origin frame pixels. Only for a camera that has its tracker to itself.
    FramePx,
}
