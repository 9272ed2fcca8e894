//! One lens as another model, where the two are the same function.

use crate::calibration::native::{NativeIdeal, NativeLens};

/// `fx, fy, cx, cy`.
pub(super) type Pinhole = [f64; 4];

fn pinhole(ideal: &NativeIdeal) -> Option<Pinhole> {
    let fx = ideal.fx.or(ideal.focal)?;
    let fy = ideal.fy.or(ideal.focal)?;
    Some([fx, fy, ideal.cx, ideal.cy])
}

pub(super) fn rectilinear(lens: &NativeLens) -> Option<Pinhole> {
    match lens {
        NativeLens::Rectilinear(lens) => pinhole(lens),
        _ => None,
    }
}

/// Kannala-Brandt: `k1 … k4` and the skew in pixels. The equidistant lens has none of them.
pub(super) fn kannala_brandt(lens: &NativeLens) -> Option<(Pinhole, [f64; 4], f64)> {
    match lens {
        NativeLens::KannalaBrandt(lens) => {
            Some(([lens.fx, lens.fy, lens.cx, lens.cy], lens.k, lens.skew))
        }
        NativeLens::Equidistant(lens) => Some((pinhole(lens)?, [0.0; 4], 0.0)),
        _ => None,
    }
}

/// Unified camera model. The stereographic lens is the one with `alpha` ½:
/// `sin(theta) / (½ + ½ cos(theta)) = 2 tan(theta / 2)`.
pub(super) fn ucm(lens: &NativeLens) -> Option<(Pinhole, f64)> {
    match lens {
        NativeLens::Ucm(lens) => Some(([lens.fx, lens.fy, lens.cx, lens.cy], lens.alpha)),
        NativeLens::Stereographic(lens) => Some((pinhole(lens)?, 0.5)),
        _ => None,
    }
}

/// Enhanced unified camera model: `beta` 1 for the unified one.
pub(super) fn eucm(lens: &NativeLens) -> Option<(Pinhole, f64, f64)> {
    match lens {
        NativeLens::Eucm(lens) => {
            let pinhole = [lens.fx, lens.fy, lens.cx, lens.cy];
            Some((pinhole, lens.alpha, lens.beta))
        }
        _ => ucm(lens).map(|(pinhole, alpha)| (pinhole, alpha, 1.0)),
    }
}

/// Mei's model: pinhole, `xi`, `k1 k2 p1 p2`, skew in pixels. The unified model is the one
/// without distortion: `xi = alpha / (1 − alpha)`, focal lengths divided by `1 − alpha`.
pub(super) fn mei(lens: &NativeLens) -> Option<(Pinhole, f64, [f64; 4], f64)> {
    if let NativeLens::Mei(lens) = lens {
        let pinhole = [lens.fx, lens.fy, lens.cx, lens.cy];
        let distortion = [lens.k1, lens.k2, lens.p1, lens.p2];
        return Some((pinhole, lens.xi, distortion, lens.skew));
    }
    let ([fx, fy, cx, cy], alpha) = ucm(lens)?;
    let rest = 1.0 - alpha;
    (rest > 0.0).then(|| ([fx / rest, fy / rest, cx, cy], alpha / rest, [0.0; 4], 0.0))
}
