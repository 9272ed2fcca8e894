//! Crop placement: few frame crops in which possible persons have a size that suits the detector.

use std::ops::RangeInclusive;

use nalgebra::{Rotation3, Unit, Vector2, Vector3};

use super::{
    FrameCrop, Lens, Mount, Pixel, QuarterTurn,
    hull::{hull, middle},
    pixels::to_corner_origin,
};

/// The share of a crop's side within which a person must lie to be wholly in it.
const WITHIN: f64 = 0.96;
/// A crop also serves persons who fill between these multiples of the wanted share.
const SERVED_FILL: RangeInclusive<f64> = 0.6..=1.6;
/// A crop serves persons whose up is at most about 53° from its own (cosine): beyond 45°, so that
/// neighbors on both sides of a diagonal may share a crop.
const SERVED_COSINE: f64 = 0.6;
/// The greatest enlargement, crop pixels per frame pixel: beyond it there is nothing to see.
const MAX_SCALE: f64 = 3.0;
/// Angle from straight down to the middles of the sides of the crop around the nadir, radians: a
/// person below a ceiling fills about a third of it.
const NADIR_CROP_REACH: f64 = 37.0 * std::f64::consts::PI / 180.0;
/// Most neighbors that are considered for one crop; bounds the work.
const MAX_NEIGHBORS: usize = 32;
/// Boxes smaller than this, pixels, are taken to be of this size.
const MIN_EXTENT: f64 = 1.0;

/// A possible person, for which a crop is wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CropTarget {
    /// Its box `[x_min, y_min, x_max, y_max]`, corner-origin frame pixels.
    pub bbox: [f64; 4],
    /// The score as a person, above 0.
    pub score: f64,
    /// The direction in which it stands, frame pixels, unit length.
    pub up: Vector2<f64>,
}

impl CropTarget {
    /// Returns the middle of the box.
    pub fn center(&self) -> Pixel {
        middle(self.bbox)
    }

    /// The larger side.
    fn extent(&self) -> f64 {
        larger_side(self.bbox).max(MIN_EXTENT)
    }
}

fn larger_side([x_min, y_min, x_max, y_max]: [f64; 4]) -> f64 {
    (x_max - x_min).max(y_max - y_min)
}

/// Places up to `most` crops of `side` × `side` pixels.
///
/// Targets come best first. Each one that no earlier crop serves gets a crop of its own turn, in
/// which its larger side fills the share `fill`. That crop is moved to where it serves the
/// greatest sum of scores of further targets of about the same size and direction.
pub fn place_crops(targets: &[CropTarget], most: usize, fill: f64, side: u32) -> Vec<FrameCrop> {
    let mut crops = Vec::with_capacity(most);
    let mut unserved: Vec<&CropTarget> = targets.iter().collect();
    while crops.len() < most && !unserved.is_empty() {
        let first = unserved.remove(0);
        let crop = crop_around(first, &unserved, fill, side);
        unserved.retain(|target| !(suits(&crop, target, fill) && shows(&crop, target)));
        crops.push(crop);
    }
    crops
}

/// Returns the crop of `side` × `side` pixels around the point straight below the camera. `None` if
/// the lens does not show it.
pub fn nadir_crop(lens: &Lens, mount: &Mount, side: u32) -> Option<FrameCrop> {
    let nadir = mount.nadir();
    let center = lens.project(&nadir)?;
    let across = Unit::try_new(Vector3::z().cross(&nadir), 1e-6);
    let across = across.unwrap_or_else(Vector3::x_axis);
    let reaches = [NADIR_CROP_REACH, -NADIR_CROP_REACH].map(|angle| {
        let edge = lens.project(&(Rotation3::from_axis_angle(&across, angle) * nadir))?;
        Some((edge - center).norm())
    });
    let reach = reaches.into_iter().flatten().fold(0.0, f64::max);
    (reach > 0.0).then(|| FrameCrop {
        turn: QuarterTurn::None,
        is_mirrored: false,
        center: to_corner_origin(center),
        scale: (f64::from(side) / (2.0 * reach)).min(MAX_SCALE),
        width: side,
        height: side,
    })
}

/// A crop that serves `first` and as many of the others as it can.
fn crop_around(first: &CropTarget, others: &[&CropTarget], fill: f64, side: u32) -> FrameCrop {
    let mut crop = FrameCrop {
        turn: QuarterTurn::nearest(first.up),
        is_mirrored: false,
        center: first.center(),
        scale: (fill * f64::from(side) / first.extent()).min(MAX_SCALE),
        width: side,
        height: side,
    };
    let reach = WITHIN * f64::from(side) / crop.scale;
    let may_share = |target: &&&CropTarget| {
        suits(&crop, target, fill) && larger_side(hull(first.bbox, target.bbox)) <= reach
    };
    let neighbors = others.iter().filter(may_share).take(MAX_NEIGHBORS);
    let neighbors: Vec<&CropTarget> = neighbors.copied().collect();
    crop.center = middle(best_hull(first, &neighbors, reach));
    crop
}

/// The hull of `first` and of those neighbors that, within a square of side `reach`, have the
/// greatest sum of scores. The square may be moved until the hull touches its left and upper
/// sides, so that these need only be tried where boxes begin.
fn best_hull(first: &CropTarget, neighbors: &[&CropTarget], reach: f64) -> [f64; 4] {
    let begins = |axis: usize| {
        let all = neighbors.iter().map(|target| target.bbox[axis]);
        let all = all.chain([first.bbox[axis]]);
        let holds_first = |&begin: &f64| {
            begin <= first.bbox[axis]
                && (first.bbox[axis + 2] <= begin + reach || begin == first.bbox[axis])
        };
        all.filter(holds_first).collect::<Vec<f64>>()
    };
    let mut best = (0.0, first.bbox);
    for &left in &begins(0) {
        for &top in &begins(1) {
            let is_within = |target: &&&CropTarget| {
                let [x_min, y_min, x_max, y_max] = target.bbox;
                left <= x_min && x_max <= left + reach && top <= y_min && y_max <= top + reach
            };
            let mut found = (0.0, first.bbox);
            for target in neighbors.iter().filter(is_within) {
                found = (found.0 + target.score, hull(found.1, target.bbox));
            }
            if found.0 > best.0 {
                best = found;
            }
        }
    }
    best.1
}

/// Returns true when a target has about the size and the direction for which the crop was made.
fn suits(crop: &FrameCrop, target: &CropTarget, fill: f64) -> bool {
    let filled = crop.scale * target.extent() / f64::from(crop.width);
    SERVED_FILL.contains(&(filled / fill)) && crop.turn.up().dot(&target.up) >= SERVED_COSINE
}

/// Returns true when a target lies wholly in the crop.
fn shows(crop: &FrameCrop, target: &CropTarget) -> bool {
    let reach = WITHIN * f64::from(crop.width) / crop.scale / 2.0 + 1e-6;
    let offsets = [0, 1, 2, 3].map(|side| target.bbox[side] - crop.center[side % 2]);
    offsets.iter().all(|offset| offset.abs() <= reach)
}

#[cfg(test)]
mod tests;
