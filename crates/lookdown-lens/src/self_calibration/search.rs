//! Starting points: lenses on a grid, and for each the directions that most edges agree on.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{Matrix3, Rotation3};

use super::{
    camera::{Angles, RoomCamera, curve, ideal_shape},
    evidence::EdgeCurve,
    known_camera::{FieldOfView, KnownCamera},
    prior::Prior,
};
use crate::{geometry::Ray, saturating::to_usize};

/// First coefficients of the tried lenses: orthographic, between, equisolid, equidistant,
/// stereographic.
const SHAPES: [f64; 5] = [-1.0 / 6.0, -0.094, -1.0 / 24.0, 0.0, 1.0 / 12.0];
/// Angles at the circle of the tried lenses, degrees.
const RIMS: [f64; 7] = [72.0, 78.0, 84.0, 90.0, 96.0, 102.0, 108.0];
/// Width of the kernel: the sine of an angle.
const KERNEL: f64 = 0.035;
/// The same for the directions of `triples`, which are 3 degrees apart.
const WIDE_KERNEL: f32 = 0.05;
/// Cosine of the angle at which an edge is so near a direction that it says nothing about it.
const NEAR: f32 = 0.97;
/// Planes of a block.
const LANES: usize = 8;
/// Verticals of one lens whose headings are tried.
const VERTICALS: usize = 4;
/// Headings over a quarter turn.
const HEADINGS: usize = 45;

struct Plane {
    normal: Ray,
    middle: Ray,
    weight: f64,
}

/// Returns the cameras with a lens of the grid, straight down, with their tables of angles.
fn lenses(prior: &Prior, known: KnownCamera) -> impl Iterator<Item = (RoomCamera, Angles)> {
    let shapes = known.lens.map_or(SHAPES.to_vec(), |lens| vec![lens.k1()]);
    let rims = known
        .field_of_view
        .map_or(RIMS.map(f64::to_radians).to_vec(), |field| {
            vec![field.max_theta()]
        });
    let (center, radius) = (prior.circle.center, prior.circle.radius);
    let with = move |k1: f64, rim: f64| {
        let (at_rim, _) = curve(ideal_shape(k1), rim);
        let camera = RoomCamera {
            focal: radius / at_rim,
            k1,
            k2_offset: 0.0,
            center,
            room: Rotation3::identity(),
        };
        let angles = Angles::from_camera(&camera, radius)?;
        Some((camera, angles))
    };
    shapes.into_iter().flat_map(move |k1| {
        rims.clone()
            .into_iter()
            .filter_map(move |rim| with(k1, rim))
    })
}

/// Returns true if a lens has the known values.
pub(super) fn has_lens(prior: &Prior, known: KnownCamera) -> bool {
    lenses(prior, known).any(|(camera, angles)| {
        let rim = angles.theta(prior.circle.radius / camera.focal);
        // A curve that turns back has the radius at a smaller angle, too.
        let is_at = |field: FieldOfView| (rim - field.max_theta()).abs() < 0.01;
        known.field_of_view.is_none_or(is_at)
    })
}

/// Returns starts in the order of their scores, best first, one or two per lens.
pub(super) fn starts(curves: &[EdgeCurve], prior: &Prior, known: KnownCamera) -> Vec<RoomCamera> {
    let triples = Triples::new();
    let mut starts: Vec<(RoomCamera, f64)> = Vec::new();
    for (camera, angles) in lenses(prior, known) {
        let planes = planes(curves, &camera, &angles);
        let rooms = directions(&planes, &triples).into_iter();
        starts.extend(rooms.map(|(room, score)| {
            let camera = RoomCamera {
                room,
                ..camera.clone()
            };
            (camera, score)
        }));
    }
    starts.sort_by(|a, b| b.1.total_cmp(&a.1));
    starts.into_iter().map(|(camera, _)| camera).collect()
}

/// The planes of the curves, weighted by length; a curve that is not a straight line has no weight.
fn planes(curves: &[EdgeCurve], camera: &RoomCamera, angles: &Angles) -> Vec<Plane> {
    let plane = |curve: &EdgeCurve| {
        let first = angles.ray(camera, *curve.points.first()?).ray;
        let last = angles.ray(camera, *curve.points.last()?).ray;
        let middle = angles.ray(camera, curve.points[curve.points.len() / 2]).ray;
        let normal = first.cross(&last).try_normalize(1e-6)?;
        let bend = normal.dot(&middle) * camera.focal / 2.0;
        let weight = curve.length().min(120.0) / (1.0 + bend * bend);
        Some(Plane {
            normal,
            middle,
            weight,
        })
    };
    curves.iter().filter_map(plane).collect()
}

fn kernel(sine: f64) -> f64 {
    let ratio = sine / KERNEL;
    let root = 1.0 / (1.0 + ratio * ratio);
    root * root
}

/// Planes by component in single precision, for vector instructions.
#[derive(Default)]
struct Block {
    normal: [[f32; LANES]; 3],
    middle: [[f32; LANES]; 3],
    weight: [f32; LANES],
}

#[expect(clippy::cast_possible_truncation, reason = "scores are not exact")]
fn blocks(planes: &[Plane]) -> Vec<Block> {
    let block = |planes: &[Plane]| {
        let mut block = Block::default();
        for (lane, plane) in planes.iter().enumerate() {
            for axis in 0..3 {
                block.normal[axis][lane] = plane.normal[axis] as f32;
                block.middle[axis][lane] = plane.middle[axis] as f32;
            }
            block.weight[lane] = plane.weight as f32;
        }
        block
    };
    planes.chunks(LANES).map(block).collect()
}

fn dots(of: &[[f32; LANES]; 3], [x, y, z]: [f32; 3]) -> [f32; LANES] {
    std::array::from_fn(|lane| x * of[0][lane] + y * of[1][lane] + z * of[2][lane])
}

/// The weight of the planes through a direction, without those of edges near it.
#[expect(clippy::cast_possible_truncation, reason = "scores are not exact")]
fn along(blocks: &[Block], direction: &Ray) -> f64 {
    let [x, y, z] = [direction.x, direction.y, direction.z].map(|part| part as f32);
    let mut sums = [0.0_f32; LANES];
    for Block {
        normal,
        middle,
        weight,
    } in blocks
    {
        let mut scores = dots(normal, [x, y, z]);
        for (score, weight) in scores.iter_mut().zip(weight) {
            let ratio = *score * (1.0 / WIDE_KERNEL);
            let squares = 1.0 + ratio * ratio;
            *score = weight / (squares * squares);
        }
        let cosines = dots(middle, [x, y, z]);
        for ((sum, score), cosine) in sums.iter_mut().zip(scores).zip(cosines) {
            *sum += if cosine.abs() < NEAR { score } else { 0.0 };
        }
    }
    sums.iter().copied().map(f64::from).sum()
}

/// The two best rooms with their scores.
fn directions(planes: &[Plane], triples: &Triples) -> Vec<(Rotation3<f64>, f64)> {
    let total: f64 = planes.iter().map(|plane| plane.weight).sum();
    let blocks = blocks(planes);
    let along: Vec<f64> = triples
        .rays
        .iter()
        .map(|direction| along(&blocks, direction))
        .collect();
    let mut scored = triples.scores(&along);
    scored.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut peaks: Vec<Ray> = Vec::new();
    for (ray, _) in scored {
        if peaks.iter().all(|peak| peak.angle(&ray) > 0.1) {
            peaks.push(ray);
        }
        if peaks.len() == VERTICALS {
            break;
        }
    }
    let mut found: Vec<(Rotation3<f64>, f64)> = peaks
        .iter()
        .map(|down| heading(planes, *down, total))
        .collect();
    found.sort_by(|a, b| b.1.total_cmp(&a.1));
    found.truncate(2);
    found
}

/// The heading at which most edges fit, and its score.
fn heading(planes: &[Plane], down: Ray, total: f64) -> (Rotation3<f64>, f64) {
    let first = Ray::y().cross(&down).normalize();
    let second = down.cross(&first);
    let mut best = (Rotation3::identity(), f64::NEG_INFINITY);
    for index in 0..HEADINGS {
        let angle = FRAC_PI_2 * index as f64 / HEADINGS as f64;
        let x = first * angle.cos() + second * angle.sin();
        let y = down.cross(&x);
        let mut score = 0.0;
        for plane in planes {
            let nearest = [&x, &y, &down].map(|direction| plane.normal.dot(direction).abs());
            score += plane.weight * kernel(nearest[0].min(nearest[1]).min(nearest[2]));
        }
        if score > best.1 {
            let axes = Matrix3::from_columns(&[x, y, down]);
            best = (Rotation3::from_matrix_unchecked(axes), score);
        }
    }
    (best.0, best.1 / total.max(1e-9))
}

/// Orthogonal triples of directions on a grid: a vertical near the axis, and two horizontal ones.
///
/// A room whose vertical edges are few is found from its horizontal ones, because all three count.
///
/// Largest tilt of a vertical, degrees.
const MAX_TILT: f64 = 36.0;
/// Distance between neighbors, degrees.
const STEP: f64 = 3.0;
/// Rings around the axis, without the axis itself.
const RINGS: usize = 30;
/// Headings over a quarter turn.
const TRIPLE_HEADINGS: usize = 30;

/// The grid.
pub(super) struct Triples {
    /// Directions over the half sphere around the axis.
    pub rays: Vec<Ray>,
    /// For each of the first directions, the indices of both horizontal ones at each heading.
    horizontals: Vec<[[usize; 2]; TRIPLE_HEADINGS]>,
}

impl Triples {
    pub(super) fn new() -> Self {
        let mut rays = vec![Ray::z()];
        let mut starts = vec![0];
        let mut verticals = 1;
        let mut tilt = 0.0;
        for _ in 0..RINGS {
            tilt += STEP;
            starts.push(rays.len());
            let (sin, cos) = f64::to_radians(tilt).sin_cos();
            let count = (TAU * sin / STEP.to_radians()).round();
            let mut index = 0.0;
            while index < count {
                let (y, x) = (TAU * index / count).sin_cos();
                rays.push(Ray::new(sin * x, sin * y, cos));
                index += 1.0;
            }
            if tilt <= MAX_TILT {
                verticals = rays.len();
            }
        }
        starts.push(rays.len());
        let horizontals = rays[..verticals]
            .iter()
            .map(|down| {
                let first = Ray::y().cross(down).normalize();
                let second = down.cross(&first);
                std::array::from_fn(|heading| {
                    let angle = FRAC_PI_2 * heading as f64 / TRIPLE_HEADINGS as f64;
                    let (sin, cos) = angle.sin_cos();
                    [first * cos + second * sin, second * cos - first * sin]
                        .map(|ray| nearest(&starts, &ray))
                })
            })
            .collect();
        Self { rays, horizontals }
    }

    /// Each vertical with the best sum of the values of a triple.
    pub(super) fn scores(&self, values: &[f64]) -> Vec<(Ray, f64)> {
        let best = |horizontals: &[[usize; 2]; TRIPLE_HEADINGS]| {
            let sums = horizontals.iter().map(|[x, y]| values[*x] + values[*y]);
            sums.fold(0.0, f64::max)
        };
        self.rays
            .iter()
            .zip(values)
            .zip(&self.horizontals)
            .map(|((ray, value), horizontals)| (*ray, value + best(horizontals)))
            .collect()
    }
}

/// The index of the direction of the grid next to a line through the center.
fn nearest(starts: &[usize], ray: &Ray) -> usize {
    let ray = if ray.z < 0.0 { -ray } else { *ray };
    let tilt = ray.x.hypot(ray.y).atan2(ray.z).to_degrees();
    let ring = to_usize((tilt / STEP).round()).min(RINGS);
    let count = starts[ring + 1] - starts[ring];
    let turn = (ray.y.atan2(ray.x) / TAU).rem_euclid(1.0);
    let index = to_usize((turn * count as f64).round()) % count;
    starts[ring] + index
}
