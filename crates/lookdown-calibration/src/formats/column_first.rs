//! Scaramuzza's model as programs after `OCamCalib` store it: x runs along the columns, so that
//! `u = c·x + d·y + cx`, `v = e·x + y + cy`.

use super::FormatError;
use lookdown_lens::geometry::lens::Ocam;

/// The model with its x axis along the columns.
pub(super) struct ColumnFirst {
    /// The direct polynomial with `OCamCalib`'s signs: the first coefficient is negative.
    pub(super) polynomial: Vec<f64>,
    pub(super) c: f64,
    pub(super) d: f64,
    pub(super) e: f64,
    pub(super) cx: f64,
    pub(super) cy: f64,
}

impl ColumnFirst {
    /// The same lens with `OCamCalib`'s axes, whose affine map has its 1 in the other corner.
    ///
    /// With `rho' = c·rho` the maps agree for `c' = 1/c`, `d' = e/c`, `e' = d/c`, and the
    /// polynomial for `a'_i = a_i·c^(1-i)`, because `theta = atan2(rho, -p(rho))` must stay.
    pub(super) fn into_lens(self) -> Result<Ocam, FormatError> {
        let Self {
            c, d, e, cx, cy, ..
        } = self;
        if !(c.is_finite() && c > 0.0) {
            return Err(FormatError::invalid(
                "c",
                format!("it is {c}: the stretch of the columns must be above 0, and near 1"),
            ));
        }
        let mut factor = c;
        let mut polynomial = self.polynomial;
        for coefficient in &mut polynomial {
            *coefficient *= factor;
            factor /= c;
        }
        Ok(Ocam {
            c: 1.0 / c,
            d: e / c,
            e: d / c,
            ..Ocam::new(polynomial, [cx, cy])
        })
    }
}

/// Turns a direct polynomial whose z axis points out of the lens into `OCamCalib`'s signs.
pub(super) fn negated(polynomial: &[f64]) -> Vec<f64> {
    polynomial.iter().map(|coefficient| -coefficient).collect()
}
