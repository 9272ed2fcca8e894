//! One lens as another model, where the two are the same function.

use lookdown_lens::geometry::lens::{LensModel, Pinhole};

pub(super) fn rectilinear(lens: &LensModel) -> Option<Pinhole> {
    match lens {
        LensModel::Rectilinear(lens) => lens.pinhole(),
        _ => None,
    }
}

/// Kannala-Brandt: `k1 … k4` and the skew in pixels. The equidistant lens has none of them.
pub(super) fn kannala_brandt(lens: &LensModel) -> Option<(Pinhole, [f64; 4], f64)> {
    match lens {
        LensModel::KannalaBrandt(lens) => Some((lens.pinhole(), lens.k, lens.skew)),
        LensModel::Equidistant(lens) => Some((lens.pinhole()?, [0.0; 4], 0.0)),
        _ => None,
    }
}

/// Unified camera model. The stereographic lens is the one with `alpha` ½:
/// `sin(theta) / (½ + ½ cos(theta)) = 2 tan(theta / 2)`.
pub(super) fn ucm(lens: &LensModel) -> Option<(Pinhole, f64)> {
    match lens {
        LensModel::Ucm(lens) => Some((lens.pinhole(), lens.alpha)),
        LensModel::Stereographic(lens) => Some((lens.pinhole()?, 0.5)),
        _ => None,
    }
}

/// Enhanced unified camera model: `beta` 1 for the unified one.
pub(super) fn eucm(lens: &LensModel) -> Option<(Pinhole, f64, f64)> {
    match lens {
        LensModel::Eucm(lens) => Some((lens.pinhole(), lens.alpha, lens.beta)),
        _ => ucm(lens).map(|(pinhole, alpha)| (pinhole, alpha, 1.0)),
    }
}

/// Mei's model: pinhole, `xi`, `k1 k2 p1 p2`, skew in pixels. The unified model is the one
/// without distortion: `xi = alpha / (1 − alpha)`, focal lengths divided by `1 − alpha`.
pub(super) fn mei(lens: &LensModel) -> Option<(Pinhole, f64, [f64; 4], f64)> {
    if let LensModel::Mei(lens) = lens {
        let distortion = [lens.k1, lens.k2, lens.p1, lens.p2];
        return Some((lens.pinhole(), lens.xi, distortion, lens.skew));
    }
    let ([fx, fy, cx, cy], alpha) = ucm(lens)?;
    let rest = 1.0 - alpha;
    (rest > 0.0).then(|| ([fx / rest, fy / rest, cx, cy], alpha / rest, [0.0; 4], 0.0))
}
