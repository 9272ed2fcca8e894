//! Zoomed views: a closer look at each place where a person may be.

use std::ops::RangeInclusive;

use super::{Mount, Ray, VirtualView};

/// Opening angles of zoomed views, radians: 12° to 90°.
const FIELD_OF_VIEW: RangeInclusive<f64> = 0.209_439_51..=std::f64::consts::FRAC_PI_2;
/// Turns toward the middle of the person: a second one no longer moves it by a pixel.
const TURNS: u32 = 2;
/// A person within this share of a view, from its middle, is wholly in it.
const WITHIN: f64 = 0.95;
/// A view also serves other people in it who fill between these multiples of what it was placed
/// for.
const SERVED_FILL: RangeInclusive<f64> = 0.6..=1.6;

/// Places up to `most` upright views of `width` × `height` pixels, each so that the larger extent
/// of one outline fills the share `fill` of the view's shorter side. Outlines (rays in the camera
/// frame, each non-empty) come best first; those that an earlier view shows whole and at a similar
/// size need none of their own.
#[must_use]
pub fn zoomed_views(
    outlines: &[Vec<Ray>],
    most: usize,
    fill: f64,
    mount: &Mount,
    [width, height]: [u32; 2],
) -> Vec<VirtualView> {
    let mut views: Vec<VirtualView> = Vec::with_capacity(most);
    for outline in outlines {
        if views.len() >= most {
            break;
        }
        if !views.iter().any(|view| serves(view, outline, fill)) {
            views.extend(zoomed(outline, fill, mount, [width, height]));
        }
    }
    views
}

fn zoomed(
    outline: &[Ray],
    fill: f64,
    mount: &Mount,
    [width, height]: [u32; 2],
) -> Option<VirtualView> {
    let half_side = f64::from(width.min(height)) / 2.0;
    let along = |axis: &Ray, half_angle_tangent: f64| {
        VirtualView::looking_along(axis, half_side / half_angle_tangent, mount, width, height)
    };
    let mut axis = outline.iter().sum::<Ray>().try_normalize(f64::EPSILON)?;
    let mut view = along(&axis, 1.0);
    for _ in 0..TURNS {
        let extent = Extent::of(outline, &view)?;
        axis = view.camera_from_view() * Ray::new(extent.middle(0), extent.middle(1), 1.0);
        view = along(&axis, 1.0);
    }
    let (narrowest, widest) = FIELD_OF_VIEW.into_inner();
    let needed = Extent::of(outline, &view)?.half() / fill;
    let half_angle_tangent = needed.clamp((narrowest / 2.0).tan(), (widest / 2.0).tan());
    Some(along(&axis, half_angle_tangent))
}

/// Returns true when the view shows the outline whole, about as large as it was placed for.
fn serves(view: &VirtualView, outline: &[Ray], fill: f64) -> bool {
    let half_side = f64::from(view.width().min(view.height())) / 2.0 / view.focal();
    Extent::of(outline, view).is_some_and(|extent| {
        extent.farthest() <= WITHIN * half_side
            && SERVED_FILL.contains(&(extent.half() / half_side / fill))
    })
}

/// The extent of an outline in a view, in tangents of the angle from its axis.
struct Extent {
    low: [f64; 2],
    high: [f64; 2],
}

impl Extent {
    /// `None` when a part of the outline is beside or behind the view.
    fn of(outline: &[Ray], view: &VirtualView) -> Option<Self> {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for ray in outline {
            let ray = view.camera_from_view().inverse_transform_vector(ray);
            if ray.z <= 0.0 {
                return None;
            }
            for axis in 0..2 {
                low[axis] = low[axis].min(ray[axis] / ray.z);
                high[axis] = high[axis].max(ray[axis] / ray.z);
            }
        }
        low[0].is_finite().then_some(Self { low, high })
    }

    fn middle(&self, axis: usize) -> f64 {
        f64::midpoint(self.low[axis], self.high[axis])
    }

    /// Half the larger side.
    fn half(&self) -> f64 {
        (self.high[0] - self.low[0]).max(self.high[1] - self.low[1]) / 2.0
    }

    /// The greatest distance from the axis, horizontally or vertically.
    fn farthest(&self) -> f64 {
        let sides = self.low.iter().chain(&self.high);
        sides.fold(0.0, |farthest, side| farthest.max(side.abs()))
    }
}

#[cfg(test)]
mod tests;
