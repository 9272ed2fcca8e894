//! The people whose boxes tell their heights.

use crate::geometry::PersonHeight;

/// Reports repeat the same people: more boxes are no more evidence than these.
pub(super) const MAX_INDEPENDENT: f64 = 30.0;
/// Least angle between the feet of a person and straight down, radians. Nearer people hide their
/// feet, so that they seem taller than they are: by 7 % at 30° to 45°, and by 18 % below.
const LEAST_FOOT_ANGLE: f64 = 0.698;

/// Returns true for people far enough away to show their feet.
pub(super) fn has_visible_feet(person: &PersonHeight) -> bool {
    person.foot_angle >= LEAST_FOOT_ANGLE
}
