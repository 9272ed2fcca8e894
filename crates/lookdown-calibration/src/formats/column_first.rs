//! Scaramuzza's model as programs after `OCamCalib` store it: x runs along the columns, so that
//! `u = c·x + d·y + cx`, `v = e·x + y + cy`.

use super::{FormatError, fields::Fields};
use lookdown_lens::geometry::lens::Ocam;

/// The model with its x axis along the columns.
pub(super) struct ColumnFirst {
    /// The direct polynomial with `OCamCalib`'s signs: the first coefficient is negative.
    pub(super) polynomial: Vec<f64>,
    /// `c`, `d`, `e`.
    pub(super) affine: [f64; 3],
    /// `cx`, `cy`.
    pub(super) center: [f64; 2],
}

impl ColumnFirst {
    /// Reads the center and the stretch matrix of these fields, beside a polynomial whose z axis
    /// points out of the lens.
    pub(super) fn read(
        fields: &Fields<'_>,
        [center, stretch]: [&str; 2],
        polynomial: &[f64],
    ) -> Result<Self, FormatError> {
        let center = fields.exactly(center, "column and row")?;
        let [c, d, e, one] = fields.exactly(stretch, "[[c, d], [e, 1]]")?;
        if one != 1.0 {
            let problem = format!("its last number is {one}: it must be 1");
            return Err(fields.invalid(stretch, problem));
        }
        Ok(Self {
            polynomial: negated(polynomial),
            affine: [c, d, e],
            center,
        })
    }

    /// The same lens with `OCamCalib`'s axes, whose affine map has its 1 in the other corner.
    ///
    /// With `rho' = c·rho` the maps agree for `c' = 1/c`, `d' = e/c`, `e' = d/c`, and the
    /// polynomial for `a'_i = a_i·c^(1-i)`, because `theta = atan2(rho, -p(rho))` must stay.
    pub(super) fn into_lens(self) -> Result<Ocam, FormatError> {
        let [c, d, e] = self.affine;
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
            ..Ocam::new(polynomial, self.center)
        })
    }
}

/// Turns a direct polynomial whose z axis points out of the lens into `OCamCalib`'s signs.
pub(super) fn negated(polynomial: &[f64]) -> Vec<f64> {
    polynomial.iter().map(|coefficient| -coefficient).collect()
}
