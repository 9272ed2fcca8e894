//! A camera from its own frames: lens circle and edges, then the fit of [`RoomFit`].

use lookdown_lens::self_calibration::{CircleGuess, EdgeCurve, FitRefusal, KnownLens, RoomFit};

use super::{
    edge_curves::{USED_RADIUS, edge_curves},
    frame::Frame,
    lens_circle::{LensCircle, agreed_circle, assumed_circle, find_lens_circle},
};

/// Standard deviation of the optical center from that of the lens circle, in short sides.
const CENTER_SIGMA: f64 = 0.003;
/// Standard deviation of the optical center from that of the frame, in short sides.
const FRAME_CENTER_SIGMA: f64 = 0.012;
/// Distance by which the points of a curve may lie beyond the used part of the circle, pixels.
const BEYOND: f64 = 2.0;
/// Most curves of a frame: the longest. A cluttered room of 1680 by 1680 pixels has fewer.
const MAX_CURVES: usize = 2000;

/// The parts of a frame that a fit needs: much smaller than its pixels, and without people.
#[derive(Debug, Clone, PartialEq)]
pub struct RoomFrame {
    width: u32,
    height: u32,
    /// The detected circle.
    circle: Option<LensCircle>,
    /// Edges inside the circle.
    curves: Vec<EdgeCurve>,
}

impl RoomFrame {
    /// Finds the lens circle and the edges of a frame.
    #[must_use]
    pub fn of(frame: &Frame) -> Self {
        let (width, height) = (frame.width(), frame.height());
        let circle = find_lens_circle(frame);
        let used = circle.unwrap_or_else(|| assumed_circle(width, height));
        let mut curves = edge_curves(frame, &used);
        if curves.len() > MAX_CURVES {
            curves.sort_by_key(|curve| std::cmp::Reverse(curve.points.len()));
            curves.truncate(MAX_CURVES);
        }
        Self {
            width,
            height,
            circle,
            curves,
        }
    }

    /// Returns width and height of the frame, pixels.
    #[must_use]
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// The edges inside a circle.
    fn within(&self, circle: &LensCircle) -> Vec<EdgeCurve> {
        let reach = USED_RADIUS * circle.radius + BEYOND;
        let is_inside = |[x, y]: &[f64; 2]| (x - circle.cx).hypot(y - circle.cy) < reach;
        let inside = |curve: &&EdgeCurve| curve.points.iter().all(is_inside);
        self.curves.iter().filter(inside).cloned().collect()
    }
}

/// Fits lens, center and level to frames of one camera, all of one size.
///
/// # Errors
/// [`FitRefusal`] when the edges do not determine the camera.
pub fn fit_room(frames: &[RoomFrame], known: KnownLens) -> Result<RoomFit, FitRefusal> {
    let Some(first) = frames.first() else {
        return Err(FitRefusal::TooFewEdges { edges: 0 });
    };
    let circles: Vec<_> = frames.iter().filter_map(|frame| frame.circle).collect();
    let found = agreed_circle(&circles).map(|agreed| agreed.circle);
    let assumed = assumed_circle(first.width, first.height);
    let side = f64::from(first.width.min(first.height));
    let circle = found.unwrap_or(assumed);
    let curves: Vec<_> = frames.iter().map(|frame| frame.within(&circle)).collect();
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
