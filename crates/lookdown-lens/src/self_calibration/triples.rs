//! Orthogonal triples of directions on a grid: a vertical near the axis, and two horizontal ones.
//!
//! A room whose vertical edges are few is found from its horizontal ones, because all three count.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::geometry::Ray;
use crate::saturating::to_usize;

/// Largest tilt of a vertical, degrees.
const MAX_TILT: f64 = 36.0;
/// Distance between neighbors, degrees.
const STEP: f64 = 3.0;
/// Rings around the axis, without the axis itself.
const RINGS: usize = 30;
/// Headings over a quarter turn.
const HEADINGS: usize = 30;

/// The grid.
pub(super) struct Triples {
    /// Directions over the half sphere around the axis.
    pub rays: Vec<Ray>,
    /// For each of the first directions, the indices of both horizontal ones at each heading.
    horizontals: Vec<[[usize; 2]; HEADINGS]>,
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
                    let angle = FRAC_PI_2 * heading as f64 / HEADINGS as f64;
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
        let best = |horizontals: &[[usize; 2]; HEADINGS]| {
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
