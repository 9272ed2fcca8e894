//! The rim to a fraction of a pixel, along rays near a known circle.

use std::f64::consts::TAU;

use super::LensCircle;
use super::surround::{Surround, brightness};
use crate::imaging::frame::Frame;

/// Rays around the circle.
const RAYS: u32 = 360;
/// How far inside the rim its brightness is measured, as a part of the radius: farther
/// than the blur of a rim reaches.
const INSIDE: f64 = 0.03;
/// Samples in a row, one pixel apart, that must be lit: noise is shorter.
const LIT_RUN: usize = 3;

/// Where one ray meets the rim.
pub(super) struct RimPoint {
    /// Direction of the ray from the centre of the circle it was sought along, in radians.
    pub angle: f64,
    /// The rim in pixel centres.
    pub at: [f64; 2],
}

/// The rim on every ray that shows one within `reach` (a part of the radius) on either
/// side of the circle, by growing angle.
pub(super) fn points(
    frame: &Frame,
    surround: &Surround,
    circle: &LensCircle,
    reach: f64,
) -> Vec<RimPoint> {
    let mut profile = Vec::new();
    rays()
        .filter_map(|angle| {
            let outermost = circle.radius * (1.0 + reach);
            let length = circle.radius * (2.0 * reach + INSIDE) + 6.0;
            profile.clear();
            profile.extend(
                (0..)
                    .map(f64::from)
                    .take_while(|inward| *inward < length)
                    .map(|inward| (outermost - inward, circle.on_ray(angle, outermost - inward)))
                    .filter_map(|(radius, at)| Some((radius, sample(frame, at)?))),
            );
            let radius = rim_radius(&profile, surround, circle.radius * INSIDE)?;
            Some(RimPoint {
                angle,
                at: circle.on_ray(angle, radius),
            })
        })
        .collect()
}

/// Number of rays that meet the circle where the frame shows both of its sides.
pub(super) fn visible_rays(frame: &Frame, circle: &LensCircle) -> usize {
    rays()
        .filter(|angle| sample(frame, circle.on_ray(*angle, circle.radius + 2.0)).is_some())
        .count()
}

fn rays() -> impl Iterator<Item = f64> {
    (0..RAYS).map(|ray| TAU * f64::from(ray) / f64::from(RAYS))
}

/// Where, coming from outside, brightness passes halfway between the surround and the
/// picture just inside: a symmetric blur leaves that point in place.
///
/// `profile` holds radius and brightness by falling radius, one pixel apart.
fn rim_radius(profile: &[(f64, f64)], surround: &Surround, inside: f64) -> Option<f64> {
    let is_lit = |(_, value): &(f64, f64)| *value > surround.threshold;
    let first_lit = profile
        .windows(LIT_RUN)
        .position(|run| run.iter().all(is_lit))?;
    // A ray that starts lit was cut off by the frame, or crosses a caption.
    let before = first_lit.checked_sub(1)?;
    let innermost = profile[first_lit].0 - inside.max(4.0);
    let mut within: Vec<f64> = profile[first_lit..]
        .iter()
        .take_while(|(radius, _)| *radius >= innermost)
        .map(|(_, value)| *value)
        .collect();
    let middle = within.len() / 2;
    let (_, lit, _) = within.select_nth_unstable_by(middle, f64::total_cmp);
    let halfway = f64::midpoint(surround.level, *lit);
    profile[before..].windows(2).find_map(|pair| {
        let [(outer_radius, outer), (_, inner)] = *pair else {
            return None;
        };
        (outer < halfway && inner >= halfway)
            .then(|| outer_radius - (halfway - outer) / (inner - outer))
    })
}

/// Brightness between pixels, bilinear; `None` outside the frame.
fn sample(frame: &Frame, [x, y]: [f64; 2]) -> Option<f64> {
    let (left, top) = (x.floor(), y.floor());
    let inside = left >= 0.0
        && top >= 0.0
        && left + 1.0 < f64::from(frame.width())
        && top + 1.0 < f64::from(frame.height());
    if !inside {
        return None;
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "checked to lie in the frame"
    )]
    let (column, row) = (left as u32, top as u32);
    let at = |x: u32, y: u32| f64::from(brightness(frame.pixel(x, y)));
    let mix = |from: f64, to: f64, part: f64| from + part * (to - from);
    let upper = mix(at(column, row), at(column + 1, row), x - left);
    let lower = mix(at(column, row + 1), at(column + 1, row + 1), x - left);
    Some(mix(upper, lower, y - top))
}
