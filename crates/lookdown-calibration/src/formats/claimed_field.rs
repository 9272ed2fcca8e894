//! Fields of view that a file claims and its curve cannot keep.

use super::Camera;
use crate::native::NativeImage;
use crate::warning::{Warning, WarningCode};
use lookdown_lens::geometry::{Lens, LensError, lens::LensModel};

/// A camera whose lens image is said to end at `max_theta` (radians); where the curve turns over
/// before that, it ends there, and a note says so.
pub(super) fn camera(
    image: NativeImage,
    max_theta: f64,
    lens: impl Fn(f64) -> LensModel,
) -> Camera {
    let claimed = lens(max_theta);
    if let Err(LensError {
        limit: Some(limit), ..
    }) = Lens::new(&claimed)
        && max_theta > limit
    {
        let mut camera = Camera::new(Some(image), lens(limit));
        let message = format!(
            "the file claims a field of view of {:.1}°, but its curve turns over at {:.1}°: the \
             lens image ends there",
            2.0 * max_theta.to_degrees(),
            2.0 * limit.to_degrees()
        );
        let note = Warning::new(WarningCode::FieldOfViewReduced, message);
        camera.notes.push(note);
        return camera;
    }
    Camera::new(Some(image), claimed)
}
