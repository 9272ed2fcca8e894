//! A polynomial of the angle, as `WoodScape` and MOIL use it.

use crate::geometry::lens::{
    ImagePlane, LensError, check::positive, curve::FittedCurve, model::Model,
    polynomial::Polynomial,
};

lens_parameters! {
    /// `r = c0 + c1 theta + c2 theta² + …` in pixels. Valid up to the first angle at which it stops
    /// rising.
    pub struct RadialPolynomial: Centered {
        /// `c0 … cn`; `c0` is 0.
        pub coefficients: Vec<f64>,
        /// The height of a pixel's step over its width.
        #[serde(default = "crate::geometry::lens::model::one")]
        pub aspect: f64,
    }
}

impl RadialPolynomial {
    /// Creates the lens with these coefficients and center and with square pixels.
    pub fn new(coefficients: Vec<f64>, [cx, cy]: [f64; 2]) -> Self {
        Self {
            coefficients,
            aspect: 1.0,
            cx,
            cy,
            max_theta: None,
        }
    }

    pub(super) fn plane(&self) -> Result<ImagePlane, LensError> {
        let aspect = positive("aspect", self.aspect)?;
        Ok(ImagePlane::new(1.0, aspect, self.cx, self.cy))
    }
}

impl Model for RadialPolynomial {
    type Curve = FittedCurve<Polynomial>;

    fn curve(&self) -> Result<Self::Curve, LensError> {
        let polynomial = Polynomial::from_axis("coefficients", &self.coefficients)?;
        Ok(FittedCurve::radius(polynomial))
    }
}
