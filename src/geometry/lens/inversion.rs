//! Numeric inversion of radial curves that have no closed form.
//!
//! Newton from `theta = r` diverges or lands on another branch beyond 90°; a monotone table
//! brackets the root first, and Newton steps that leave the bracket become bisections.

use super::RadialCurve;

/// Entries of the bracketing table: one Newton step from a bracket this narrow is nearly exact.
const TABLE_ENTRIES: usize = 257;
/// Bound on refinement steps; three suffice for real lenses, bisection alone needs about fifty.
const MAX_STEPS: usize = 64;
/// Samples of the slope when looking for the first angle at which a curve stops rising.
const SLOPE_SAMPLES: usize = 20_000;

/// Radii of a curve at evenly spaced angles from 0 to `max_theta`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct AngleTable {
    radii: Vec<f64>,
    step: f64,
}

impl AngleTable {
    /// Tabulates `curve`, which must rise from 0 to `max_theta`.
    pub(super) fn new(curve: &RadialCurve, max_theta: f64) -> Self {
        let step = max_theta / fraction(TABLE_ENTRIES - 1);
        let radii = (0..TABLE_ENTRIES)
            .map(|index| curve.radius(step * fraction(index)))
            .collect();
        Self { radii, step }
    }

    /// The angle at which `curve` reaches `radius`, which must lie within the tabulated range.
    pub(super) fn angle(&self, curve: &RadialCurve, radius: f64) -> f64 {
        let above = self
            .radii
            .partition_point(|&tabulated| tabulated < radius)
            .clamp(1, TABLE_ENTRIES - 1);
        let (mut low, mut high) = (self.step * fraction(above - 1), self.step * fraction(above));
        let rise = self.radii[above] - self.radii[above - 1];
        let share = if rise > 0.0 {
            ((radius - self.radii[above - 1]) / rise).clamp(0.0, 1.0)
        } else {
            0.5
        };
        let mut theta = low + share * (high - low);
        for _ in 0..MAX_STEPS {
            let excess = curve.radius(theta) - radius;
            if excess > 0.0 {
                high = theta;
            } else {
                low = theta;
            }
            let newton = theta - excess / curve.slope(theta);
            let next = if newton > low && newton < high {
                newton
            } else {
                f64::midpoint(low, high)
            };
            if (next - theta).abs() <= f64::EPSILON * theta || excess == 0.0 {
                break;
            }
            theta = next;
        }
        theta
    }
}

/// The first angle in (0, `end`] at which `slope` is no longer positive; `end` when it stays
/// positive, 0 when it is not positive at 0.
pub(super) fn first_stationary_point(slope: impl Fn(f64) -> f64, end: f64) -> f64 {
    let rises = |theta: f64| slope(theta) > 0.0;
    if !rises(0.0) {
        return 0.0;
    }
    let step = end / fraction(SLOPE_SAMPLES);
    let Some(falling) = (1..=SLOPE_SAMPLES).find(|&index| !rises(step * fraction(index))) else {
        return end;
    };
    let (mut low, mut high) = (step * fraction(falling - 1), step * fraction(falling));
    for _ in 0..MAX_STEPS {
        let middle = f64::midpoint(low, high);
        if rises(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

#[expect(clippy::cast_precision_loss, reason = "indices far below 2^52")]
fn fraction(index: usize) -> f64 {
    index as f64
}
