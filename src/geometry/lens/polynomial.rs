//! Curves that are given in one direction only and inverted numerically.

/// A function from 0 that rises as far as it is used.
pub(super) trait Rising {
    fn value(&self, x: f64) -> f64;
    /// The derivative at `x`.
    fn slope(&self, x: f64) -> f64;
}

/// `c0 + c1 x + c2 x² + …`
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Polynomial(pub(super) Vec<f64>);

impl Rising for Polynomial {
    fn value(&self, x: f64) -> f64 {
        let coefficients = self.0.iter().rev();
        coefficients.fold(0.0, |sum, coefficient| sum * x + coefficient)
    }

    fn slope(&self, x: f64) -> f64 {
        let powers = (1..self.0.len()).rev();
        powers.fold(0.0, |sum, power| {
            #[expect(clippy::cast_precision_loss, reason = "a power below 64")]
            let factor = power as f64;
            sum * x + factor * self.0[power]
        })
    }
}

/// The angle of the vector (`r`, `−p(r)`) from the optical axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct OcamAngle(pub(super) Polynomial);

impl OcamAngle {
    /// Pixels per radian at the axis.
    pub(super) fn focal(&self) -> f64 {
        -self.0.value(0.0)
    }
}

impl Rising for OcamAngle {
    fn value(&self, radius: f64) -> f64 {
        radius.atan2(-self.0.value(radius))
    }

    fn slope(&self, radius: f64) -> f64 {
        let depth = self.0.value(radius);
        (radius * self.0.slope(radius) - depth) / (radius * radius + depth * depth)
    }
}
