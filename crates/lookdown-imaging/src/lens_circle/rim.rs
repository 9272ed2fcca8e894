//! Location of the rim to a fraction of a pixel, along rays near a known circle.

use std::f64::consts::TAU;

use lookdown_lens::saturating::to_usize;

use super::LensCircle;
use super::surround::{Surround, brightness};
use crate::frame::Frame;

/// Rays around the circle.
const RAYS: u32 = 360;
/// Distance inside the rim at which its brightness is measured, in radii. It exceeds the blur of a
/// rim.
const INSIDE: f64 = 0.03;
/// Minimum of the same distance, in pixels.
const MIN_INSIDE: f64 = 4.0;
/// Consecutive samples, one pixel apart, that must be lit. Noise is shorter.
const LIT_RUN: usize = 3;

/// Intersection of one ray with the rim.
pub(super) struct RimPoint {
    /// Direction of the ray from the center of the searched circle, in radians.
    pub angle: f64,
    /// The rim in pixel centers.
    pub at: [f64; 2],
}

/// Brightness at a distance from the center.
#[derive(Clone, Copy)]
struct Sample {
    radius: f64,
    value: f64,
}

/// The rim on every ray that shows one within `reach` (in radii) on either side of the circle, by
/// increasing angle.
pub(super) fn points(
    frame: &Frame,
    surround: &Surround,
    circle: &LensCircle,
    reach: f64,
) -> Vec<RimPoint> {
    let inside = (INSIDE * circle.radius).max(MIN_INSIDE);
    let outermost = circle.radius * (1.0 + reach);
    let innermost = circle.radius * (1.0 - reach) - inside;
    let mut profile = Vec::new();
    rays()
        .filter_map(|angle| {
            let (sin, cos) = angle.sin_cos();
            let on_ray = |radius: f64| [circle.cx + radius * cos, circle.cy + radius * sin];
            let radii = (0..)
                .map(|pixels| outermost - f64::from(pixels))
                .take_while(|radius| *radius >= innermost);
            profile.clear();
            profile.extend(radii.filter_map(|radius| {
                let value = brightness_at(frame, on_ray(radius))?;
                Some(Sample { radius, value })
            }));
            let radius = rim_radius(&profile, surround, inside)?;
            Some(RimPoint {
                angle,
                at: on_ray(radius),
            })
        })
        .collect()
}

/// Number of rays that meet the circle where both of its sides are in the frame.
pub(super) fn visible_rays(frame: &Frame, circle: &LensCircle) -> usize {
    let beyond = circle.radius + 2.0;
    rays()
        .map(|angle| {
            [
                circle.cx + beyond * angle.cos(),
                circle.cy + beyond * angle.sin(),
            ]
        })
        .filter(|at| brightness_at(frame, *at).is_some())
        .count()
}

fn rays() -> impl Iterator<Item = f64> {
    (0..RAYS).map(|ray| TAU * f64::from(ray) / f64::from(RAYS))
}

/// The distance at which brightness, coming from outside, passes halfway between the surround and
/// the lens image just inside. A symmetric blur does not move that point.
///
/// `profile` goes inward, one pixel at a time.
fn rim_radius(profile: &[Sample], surround: &Surround, inside: f64) -> Option<f64> {
    let is_lit = |sample: &Sample| sample.value > surround.threshold;
    let first_lit = profile
        .windows(LIT_RUN)
        .position(|run| run.iter().all(is_lit))?;
    // A ray that starts lit is cut off by the frame or crosses a caption.
    let last_dark = first_lit.checked_sub(1)?;
    let innermost = profile.get(first_lit)?.radius - inside;
    let lit: Vec<f64> = profile[first_lit..]
        .iter()
        .take_while(|sample| sample.radius >= innermost)
        .map(|sample| sample.value)
        .collect();
    let halfway = f64::midpoint(surround.level, median(lit)?);
    profile[last_dark..].windows(2).find_map(|pair| {
        let [outer, inner] = *pair else { return None };
        (outer.value < halfway && inner.value >= halfway)
            .then(|| outer.radius - (halfway - outer.value) / (inner.value - outer.value))
    })
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    values.sort_unstable_by(f64::total_cmp);
    values.get(middle).copied()
}

/// Brightness between pixels, bilinear; `None` outside the frame.
fn brightness_at(frame: &Frame, [x, y]: [f64; 2]) -> Option<f64> {
    let (left, top) = (x.floor(), y.floor());
    let is_inside = left >= 0.0
        && top >= 0.0
        && left + 1.0 < f64::from(frame.width())
        && top + 1.0 < f64::from(frame.height());
    if !is_inside {
        return None;
    }
    let (column, row) = (to_usize(left), to_usize(top));
    let line = 3 * frame.width() as usize;
    let upper = row * line + 3 * column;
    let [upper, lower] = [upper, upper + line].map(|first| {
        let pair = frame.pixels().get(first..first + 6)?;
        let [from, to] =
            [0, 3].map(|at| f64::from(brightness([pair[at], pair[at + 1], pair[at + 2]])));
        Some(from + (x - left) * (to - from))
    });
    let (upper, lower) = (upper?, lower?);
    Some(upper + (y - top) * (lower - upper))
}
