//! A camera from its own frames: lens circle and edges, then the fit of [`RoomFit`].

use lookdown_lens::self_calibration::{
    CLEARLY_EXPLAINED, CircleGuess, EdgeCurve, FitRefusal, KnownCamera, RoomFit,
};

use super::{
    edge_curves::{RASTERS, USED_RADIUS, edge_curves},
    frame::Frame,
    lens_circle::{LensCircle, agreed_circle, assumed_circle, find_lens_circle},
};

/// Standard deviation of the optical center from that of the lens circle, in short sides.
const CENTER_SIGMA: f64 = 0.003;
/// Standard deviation of the optical center from that of the frame, in short sides.
const FRAME_CENTER_SIGMA: f64 = 0.012;
/// Distance by which the points of a curve may lie beyond the used part of the circle, pixels.
const BEYOND: f64 = 2.0;
/// Share of the uncertainty of the finer raster below which the fit of a coarser one is preferred.
const CLEARLY_MORE_CERTAIN: f64 = 0.8;
/// Ratio of the sides from which a circle that is not seen is taken to be cut by the longer ones.
const CUT_ASPECT: f64 = 1.2;
/// Most curves of a frame: the longest. A cluttered room of 1680 by 1680 pixels has fewer.
const MAX_CURVES: usize = 2000;

/// The parts of a frame that a fit needs: much smaller than its pixels, and without people.
#[derive(Debug, Clone, PartialEq)]
pub struct RoomFrame {
    width: u32,
    height: u32,
    /// The detected circle.
    circle: Option<LensCircle>,
    /// Edges inside the circle: those of the finest raster first.
    curves: [Vec<EdgeCurve>; RASTERS],
}

impl RoomFrame {
    /// Finds the lens circle and the edges of a frame.
    pub fn new(frame: &Frame) -> Self {
        let (width, height) = (frame.width(), frame.height());
        let circle = find_lens_circle(frame);
        let used = circle.unwrap_or_else(|| assumed_circle(width, height));
        let mut curves = edge_curves(frame, &used);
        for curves in &mut curves {
            if curves.len() > MAX_CURVES {
                curves.sort_by_key(|curve| std::cmp::Reverse(curve.points.len()));
                curves.truncate(MAX_CURVES);
            }
        }
        Self {
            width,
            height,
            circle,
            curves,
        }
    }

    /// Returns width and height of the frame, pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Returns the edges that follow each direction of a fit to this frame and others, in the
    /// raster that the fit used. Positions are pixel centers.
    pub fn edges_along(&self, fit: &RoomFit) -> [Vec<&EdgeCurve>; 3] {
        let is_used = |curve: &EdgeCurve| (curve.scale - fit.edge_scale).abs() < 0.5;
        let mut rasters = self.curves.iter();
        let used = rasters.find(|curves| curves.first().is_some_and(is_used));
        fit.edges_along(used.map_or(&[], Vec::as_slice))
    }

    /// The edges of a raster inside a circle.
    fn within(&self, circle: &LensCircle, raster: usize) -> Vec<EdgeCurve> {
        let reach = USED_RADIUS * circle.radius + BEYOND;
        let is_inside = |[x, y]: &[f64; 2]| (x - circle.cx).hypot(y - circle.cy) < reach;
        let inside = |curve: &&EdgeCurve| curve.points.iter().all(is_inside);
        self.curves[raster].iter().filter(inside).cloned().collect()
    }
}

/// Fits lens, center and level to frames of one camera, all of one size.
///
/// # Errors
/// [`FitRefusal`] when the edges do not determine the camera.
pub fn fit_room(frames: &[RoomFrame], known: KnownCamera) -> Result<RoomFit, FitRefusal> {
    let Some(first) = frames.first() else {
        return Err(FitRefusal::TooFewEdges { edges: 0 });
    };
    let circles: Vec<_> = frames.iter().filter_map(|frame| frame.circle).collect();
    let found = agreed_circle(&circles).map(|agreed| agreed.circle);
    let assumed = assumed_circle(first.width, first.height);
    let side = f64::from(first.width.min(first.height));
    let circle = found.unwrap_or(assumed);
    let detected = found.map(|circle| CircleGuess {
        center: [circle.cx, circle.cy],
        radius: circle.radius,
        center_sigma: CENTER_SIGMA * side,
    });
    // A circle that is as large as a square frame just touches its sides.
    let is_cut = f64::from(first.width.max(first.height)) > CUT_ASPECT * side;
    // A dark part of the room may look like the surround, so the frame's own center is tried, too.
    let most = if is_cut { f64::INFINITY } else { 1.1 };
    let centered = CircleGuess {
        center: [assumed.cx, assumed.cy],
        radius: circle
            .radius
            .clamp(0.9 * assumed.radius, most * assumed.radius),
        center_sigma: FRAME_CENTER_SIGMA * side,
    };
    let guesses: Vec<_> = detected.into_iter().chain([centered]).collect();
    let fit = |raster| {
        let curves = frames.iter().map(|frame| frame.within(&circle, raster));
        RoomFit::new(&curves.collect::<Vec<_>>(), &guesses, known)
    };
    let mut best = fit(0);
    for raster in 1..RASTERS {
        if is_final(&best) {
            break;
        }
        best = better(best, fit(raster));
    }
    match (best, found) {
        (Ok(fit), None) => {
            let [x, y] = fit.center;
            let (width, height) = (f64::from(first.width), f64::from(first.height));
            let farthest = x.max(width - x).hypot(y.max(height - y));
            Ok(fit.without_circle(if is_cut { farthest } else { circle.radius }))
        }
        (best, _) => best,
    }
}

/// Returns true if a coarser raster does not help, because most edges follow the room or there are
/// too few. In a fine raster, frames that were enlarged or are noisy have many edges that are none.
fn is_final(fit: &Result<RoomFit, FitRefusal>) -> bool {
    let explained = match fit {
        Ok(fit) => Some(fit.explained),
        Err(refusal) => refusal.explained(),
    };
    explained.is_none_or(|explained| explained >= CLEARLY_EXPLAINED)
}

/// The fit of the finer raster, unless that of the coarser one says more.
fn better(
    finer: Result<RoomFit, FitRefusal>,
    coarser: Result<RoomFit, FitRefusal>,
) -> Result<RoomFit, FitRefusal> {
    let is_coarser = match (&finer, &coarser) {
        (Ok(finer), Ok(coarser)) => {
            coarser.uncertainty.radius < CLEARLY_MORE_CERTAIN * finer.uncertainty.radius
        }
        (Err(_), Ok(_)) => true,
        (Ok(_), Err(_)) => false,
        (Err(finer), Err(coarser)) => coarser.explained() > finer.explained(),
    };
    if is_coarser { coarser } else { finer }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_of_any_size_are_fitted_or_refused() {
        for (width, height) in [
            (1, 1),
            (3, 3),
            (2, 2000),
            (2000, 11),
            (39, 1701),
            (30, 8000),
            (64, 40),
        ] {
            let pixels = [40, 90, 200, 255].repeat(width as usize * height as usize)
                [..3 * width as usize * height as usize]
                .to_vec();
            let frame = Frame::new(width, height, pixels).unwrap();
            let fit = fit_room(&[RoomFrame::new(&frame)], KnownCamera::default());
            assert!(fit.is_err(), "{width}×{height}: {fit:?}");
        }
    }
}
