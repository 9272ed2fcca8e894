//! Functions that models give in one direction only and that are inverted numerically.

use super::{LensError, check::all_finite};

/// Most coefficients a polynomial may have; real calibrations have at most a dozen.
const MAX_COEFFICIENTS: usize = 64;

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
