//! Functions that models give in one direction only, and their numeric inversion.
//!
//! Newton from `theta = r` diverges or lands on another branch beyond 90°; a monotone table
//! brackets the root first, and Newton steps that leave the bracket become bisections.

use super::{LensError, error::all_finite};
use crate::saturating::to_usize;

/// Steps of the bracketing table: one Newton step from a bracket this narrow is nearly exact.
const TABLE_STEPS: usize = 1024;
/// Bound on refinement steps; three suffice for real lenses, bisection alone needs about fifty.
const MAX_STEPS: usize = 64;
/// A Newton step below this share of the place is the last one: as the error is about the square of
/// the step, the next step would change nothing.
const LAST_STEP: f64 = 1.5e-8;
/// Most coefficients a polynomial may have; real calibrations have at most a dozen.
const MAX_COEFFICIENTS: usize = 64;
/// Samples of the slope when looking for the first place at which a curve stops rising.
const SLOPE_SAMPLES: usize = 20_000;

/// A function from 0 that rises as far as it is used.
pub(super) trait Rising {
    fn value(&self, x: f64) -> f64;
    /// The derivative at `x`.
    fn slope(&self, x: f64) -> f64;
    fn value_and_slope(&self, x: f64) -> (f64, f64) {
        (self.value(x), self.slope(x))
    }
}

/// `c0 + c1 x + c2 x² + …`
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Polynomial(pub(super) Vec<f64>);

impl Polynomial {
    /// Checks the coefficients called `name`, of which the first must be 0: the principal point.
    pub(super) fn from_axis(name: &'static str, coefficients: &[f64]) -> Result<Self, LensError> {
        let polynomial = Self::checked(name, coefficients, 2)?;
        let value = coefficients[0];
        if value != 0.0 {
            let problem = format!("{name}[0] is {value}: the radius at the optical axis must be 0");
            return Err(LensError::new(problem));
        }
        Ok(polynomial)
    }

    /// Checks the coefficients called `name`: at least `least`, all finite.
    pub(super) fn checked(
        name: &'static str,
        coefficients: &[f64],
        least: usize,
    ) -> Result<Self, LensError> {
        if !(least..=MAX_COEFFICIENTS).contains(&coefficients.len()) {
            return Err(LensError::new(format!(
                "{name} has {} entries: between {least} and {MAX_COEFFICIENTS} are accepted",
                coefficients.len()
            )));
        }
        all_finite(name, coefficients)?;
        Ok(Self(coefficients.to_vec()))
    }
}

impl Rising for Polynomial {
    fn value(&self, x: f64) -> f64 {
        let coefficients = self.0.iter().rev();
        coefficients.fold(0.0, |sum, coefficient| sum * x + coefficient)
    }

    fn value_and_slope(&self, x: f64) -> (f64, f64) {
        let coefficients = self.0.iter().rev();
        coefficients.fold((0.0, 0.0), |(value, slope), coefficient| {
            (value * x + coefficient, slope * x + value)
        })
    }

    fn slope(&self, x: f64) -> f64 {
        let powers = (1..self.0.len()).rev();
        powers.fold(0.0, |sum, power| {
            let factor = power as f64;
            sum * x + factor * self.0[power]
        })
    }
}

/// A function that rises from 0 to its `end`, and a table of the places at which it reaches equally
/// spaced values.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tabulated<F> {
    function: F,
    pub(super) end: f64,
    places: Vec<f64>,
    steps_per_value: f64,
}

impl<F: Rising> Tabulated<F> {
    pub(super) fn new(function: F, end: f64) -> Self {
        let most = function.value(end);
        let mut places = vec![0.0];
        for index in 1..TABLE_STEPS {
            let value = most * fraction(index) / fraction(TABLE_STEPS);
            let low = places[index - 1];
            let curve = |x| function.value_and_slope(x);
            places.push(rising_root(
                curve,
                value,
                (low, end),
                f64::midpoint(low, end),
            ));
        }
        places.push(end);
        Self {
            steps_per_value: fraction(TABLE_STEPS) / most,
            function,
            end,
            places,
        }
    }

    /// The same function with an earlier end.
    pub(super) fn limited_to(self, end: f64) -> Self {
        Self::new(self.function, end)
    }

    pub(super) fn value(&self, x: f64) -> f64 {
        self.function.value(x)
    }

    /// Returns the place at which the function reaches `value`, which must lie within the table.
    pub(super) fn invert(&self, value: f64) -> f64 {
        let step = value * self.steps_per_value;
        // `as` cuts off the fraction and saturates.
        let index = to_usize(step).min(TABLE_STEPS - 1);
        let (low, high) = (self.places[index], self.places[index + 1]);
        let start = low + (step - fraction(index)) * (high - low);
        let curve = |x| self.function.value_and_slope(x);
        rising_root(curve, value, (low, high), start)
    }
}

/// Returns the place at which a function, which rises from `low` to `high`, reaches `value`; the
/// nearer end when it does not. `curve` returns the function's value and slope. Newton from
/// `start`, kept within the bracket by bisection.
pub(super) fn rising_root(
    curve: impl Fn(f64) -> (f64, f64),
    value: f64,
    (mut low, mut high): (f64, f64),
    start: f64,
) -> f64 {
    let mut x = start;
    for _ in 0..MAX_STEPS {
        let (reached, slope) = curve(x);
        let excess = reached - value;
        if excess > 0.0 {
            high = x;
        } else {
            low = x;
        }
        let newton = x - excess / slope;
        let is_within = newton > low && newton < high;
        let next = if is_within {
            newton
        } else {
            f64::midpoint(low, high)
        };
        let step = (next - x).abs();
        if step <= f64::EPSILON * x || excess == 0.0 {
            break;
        }
        x = next;
        if is_within && step <= LAST_STEP * x {
            break;
        }
    }
    x
}

/// The first place in (0, `end`] at which `slope` is no longer positive; `end` when it stays
/// positive, 0 when it is not positive at 0.
pub(super) fn first_stationary_point(slope: impl Fn(f64) -> f64, end: f64) -> f64 {
    let rises = |x: f64| slope(x) > 0.0;
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

fn fraction(index: usize) -> f64 {
    index as f64
}
