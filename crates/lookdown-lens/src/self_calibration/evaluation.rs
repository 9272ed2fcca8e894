//! The evidence for a camera with its normal equations, to which curves and the prior add.

use nalgebra::{SMatrix, SVector};

/// The number of parameters: focal length, two of the shape, two of the center, three of the
/// rotation.
pub(super) const PARAMETERS: usize = 8;

/// One number for each parameter.
pub(super) type Parameters = SVector<f64, PARAMETERS>;
/// One number for each pair of parameters.
pub(super) type Normal = SMatrix<f64, PARAMETERS, PARAMETERS>;

/// Evidence, and the normal equations of the parameters.
pub(super) struct Evaluation {
    /// Logarithm of the likelihood ratio, plus that of the prior.
    pub evidence: f64,
    /// Gauss-Newton matrix.
    pub normal: Normal,
    /// Right side.
    pub right: Parameters,
    /// Share of the lengths of all curves that each direction explains.
    pub shares: Vec<f64>,
    /// Explained share of each curve.
    pub explained: Vec<f64>,
}
