//! A camera from its own frames: lens circle and edges, then the fit of [`RoomFit`].

use lookdown_lens::self_calibration::{CircleGuess, FitRefusal, KnownLens, RoomFit};

use super::{
    edge_curves::edge_curves,
    frame::Frame,
    lens_circle::{agreed_circle, assumed_circle, find_lens_circle},
};

/// Standard deviation of the optical center from that of the lens circle, in short sides.
const CENTER_SIGMA: f64 = 0.003;
/// Standard deviation of the optical center from that of the frame, in short sides.
const FRAME_CENTER_SIGMA: f64 = 0.012;

/// Fits lens, center and level to frames of one camera, all of one size.
///
/// # Errors
/// [`FitRefusal`] when the edges do not determine the camera.
pub fn fit_room(frames: &[Frame], known: KnownLens) -> Result<RoomFit, FitRefusal> {
    let Some(first) = frames.first() else {
        return Err(FitRefusal::TooFewEdges { edges: 0 });
    };
    let circles: Vec<_> = frames.iter().filter_map(find_lens_circle).collect();
    let found = agreed_circle(&circles).map(|agreed| agreed.circle);
    let assumed = assumed_circle(first.width(), first.height());
    let side = f64::from(first.width().min(first.height()));
    let circle = found.unwrap_or(assumed);
    let curves: Vec<_> = frames
        .iter()
        .map(|frame| edge_curves(frame, &circle))
        .collect();
    let detected = found.map(|circle| CircleGuess {
        center: [circle.cx, circle.cy],
        radius: circle.radius,
        center_sigma: CENTER_SIGMA * side,
    });
    // A dark part of the room may look like the surround, so the frame's own center is tried, too.
    let centered = CircleGuess {
        center: [assumed.cx, assumed.cy],
        radius: circle
            .radius
            .clamp(0.9 * assumed.radius, 1.1 * assumed.radius),
        center_sigma: FRAME_CENTER_SIGMA * side,
    };
    let guesses: Vec<_> = detected.into_iter().chain([centered]).collect();
    RoomFit::of(&curves, &guesses, known)
}
