//! Numeric inversion of curves that have no closed form.
//!
//! Newton from `theta = r` diverges or lands on another branch beyond 90°; a monotone table
//! brackets the root first, and Newton steps that leave the bracket become bisections.

use super::polynomial::Rising;

/// Entries of the bracketing table: one Newton step from a bracket this narrow is nearly exact.
const TABLE_ENTRIES: usize = 257;
/// Bound on refinement steps; three suffice for real lenses, bisection alone needs about fifty.
const MAX_STEPS: usize = 64;
/// Samples of the slope when looking for the first place at which a curve stops rising.
const SLOPE_SAMPLES: usize = 20_000;

/// A function that rises from 0 to its `end`, and a table of its values there.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tabulated<F> {
    function: F,
    end: f64,
    values: Vec<f64>,
}

impl<F: Rising> Tabulated<F> {
    pub(super) fn new(function: F, end: f64) -> Self {
        let places = (0..TABLE_ENTRIES).map(|index| place(end, index));
        Self {
            values: places.map(|x| function.value(x)).collect(),
            function,
            end,
        }
    }

    /// The same function with an earlier end.
    pub(super) fn limited_to(self, end: f64) -> Self {
        Self::new(self.function, end)
    }

    pub(super) fn end(&self) -> f64 {
        self.end
    }

    pub(super) fn value(&self, x: f64) -> f64 {
        self.function.value(x)
    }

    /// Returns the place at which the function reaches `value`, which must lie within the table.
    pub(super) fn invert(&self, value: f64) -> f64 {
        let above = self
            .values
            .partition_point(|&tabulated| tabulated < value)
            .clamp(1, TABLE_ENTRIES - 1);
        let (low, high) = (place(self.end, above - 1), place(self.end, above));
        let rise = self.values[above] - self.values[above - 1];
        let share = if rise > 0.0 {
            ((value - self.values[above - 1]) / rise).clamp(0.0, 1.0)
        } else {
            0.5
        };
        rising_root(
            |x| self.function.value(x),
            |x| self.function.slope(x),
            value,
            (low, high),
            low + share * (high - low),
        )
    }
}

/// Returns the place of the table entry `index` in a table that ends at `end`.
fn place(end: f64, index: usize) -> f64 {
    end / fraction(TABLE_ENTRIES - 1) * fraction(index)
}

/// Returns the place at which `function`, which rises from `low` to `high`, reaches `value`; the
/// nearer end when it does not. Newton from `start`, kept within the bracket by bisection.
pub(super) fn rising_root(
    function: impl Fn(f64) -> f64,
    slope: impl Fn(f64) -> f64,
    value: f64,
    (mut low, mut high): (f64, f64),
    start: f64,
) -> f64 {
    let mut x = start;
    for _ in 0..MAX_STEPS {
        let excess = function(x) - value;
        if excess > 0.0 {
            high = x;
        } else {
            low = x;
        }
        let newton = x - excess / slope(x);
        let next = if newton > low && newton < high {
            newton
        } else {
            f64::midpoint(low, high)
        };
        if (next - x).abs() <= f64::EPSILON * x || excess == 0.0 {
            break;
        }
        x = next;
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

#[expect(clippy::cast_precision_loss, reason = "indices far below 2^52")]
fn fraction(index: usize) -> f64 {
    index as f64
}
