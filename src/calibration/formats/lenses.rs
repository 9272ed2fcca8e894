//! Lenses of the native shape from the parameter lists of other formats. Where the lens image ends
//! is left open: no list here tells.

use crate::calibration::native::{
    NativeDoubleSphere, NativeEucm, NativeFov, NativeIdeal, NativeKannalaBrandt, NativeLens,
    NativeMei, NativeUcm,
};

/// `fx, fy, cx, cy`: focal lengths and principal point in pixels, pixel centres.
pub(super) type Pinhole = [f64; 4];

pub(super) fn rectilinear([fx, fy, cx, cy]: Pinhole) -> NativeLens {
    NativeLens::Rectilinear(ideal([fx, fy, cx, cy]))
}

pub(super) fn equidistant([fx, fy, cx, cy]: Pinhole) -> NativeLens {
    NativeLens::Equidistant(ideal([fx, fy, cx, cy]))
}

fn ideal([fx, fy, cx, cy]: Pinhole) -> NativeIdeal {
    NativeIdeal {
        focal: None,
        fx: Some(fx),
        fy: Some(fy),
        cx,
        cy,
        max_theta: None,
    }
}

pub(super) fn kannala_brandt([fx, fy, cx, cy]: Pinhole, k: [f64; 4], skew: f64) -> NativeLens {
    NativeLens::KannalaBrandt(NativeKannalaBrandt {
        fx,
        fy,
        cx,
        cy,
        k,
        skew,
        max_theta: None,
    })
}

/// `distortion` is `k1, k2, p1, p2`.
pub(super) fn mei(
    [fx, fy, cx, cy]: Pinhole,
    xi: f64,
    [k1, k2, p1, p2]: [f64; 4],
    skew: f64,
) -> NativeLens {
    NativeLens::Mei(NativeMei {
        fx,
        fy,
        cx,
        cy,
        xi,
        k1,
        k2,
        p1,
        p2,
        skew,
        max_theta: None,
    })
}

pub(super) fn ucm([fx, fy, cx, cy]: Pinhole, alpha: f64) -> NativeLens {
    NativeLens::Ucm(NativeUcm {
        fx,
        fy,
        cx,
        cy,
        alpha,
        max_theta: None,
    })
}

pub(super) fn eucm([fx, fy, cx, cy]: Pinhole, alpha: f64, beta: f64) -> NativeLens {
    NativeLens::Eucm(NativeEucm {
        fx,
        fy,
        cx,
        cy,
        alpha,
        beta,
        max_theta: None,
    })
}

pub(super) fn double_sphere([fx, fy, cx, cy]: Pinhole, xi: f64, alpha: f64) -> NativeLens {
    NativeLens::DoubleSphere(NativeDoubleSphere {
        fx,
        fy,
        cx,
        cy,
        xi,
        alpha,
        max_theta: None,
    })
}

pub(super) fn fov([fx, fy, cx, cy]: Pinhole, omega: f64) -> NativeLens {
    NativeLens::Fov(NativeFov {
        fx,
        fy,
        cx,
        cy,
        omega,
        max_theta: None,
    })
}
