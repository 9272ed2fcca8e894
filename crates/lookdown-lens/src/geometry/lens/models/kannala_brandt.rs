//! The odd polynomial of Kannala and Brandt, as OpenCV's fisheye module uses it.

use crate::geometry::lens::{
    LensError, check::all_finite, curve::FittedCurve, model::Model, polynomial::Polynomial,
};

lens_parameters! {
    /// `r = theta (1 + k1 theta² + k2 theta⁴ + k3 theta⁶ + k4 theta⁸)`. Valid up to the first angle
    /// at which it stops rising. Kannala and Brandt 2006, eq. 6; OpenCV's fisheye module has its
    /// skew as `alpha`, with `skew = fx · alpha`.
    pub struct KannalaBrandt: SkewedPinhole {
        /// `k1 … k4`.
        pub k: [f64; 4],
    }
}

impl Model for KannalaBrandt {
    type Curve = FittedCurve<Polynomial>;

    fn curve(&self) -> Result<Self::Curve, LensError> {
        all_finite("k", &self.k)?;
        let odd_powers = self.k.into_iter().flat_map(|k| [0.0, k]);
        let coefficients = [0.0, 1.0].into_iter().chain(odd_powers).collect();
        Ok(FittedCurve::radius(Polynomial(coefficients)))
    }
}
