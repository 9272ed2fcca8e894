//! A measured place: on the floor, or a direction.

use nalgebra::{Unit, Vector2, Vector3};

/// A measured place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Place {
    /// Meters on the site's floor.
    Floor(Vector2<f64>),
    /// A direction in the camera's frame.
    Bearing(Unit<Vector3<f64>>),
}
