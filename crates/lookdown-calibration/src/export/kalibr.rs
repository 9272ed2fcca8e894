//! Kalibr's camchain with one camera. It has no skew.

use super::{
    decimal::join,
    equivalents::{eucm, kannala_brandt, mei, rectilinear},
};
use crate::native::NativeCalibration;
use lookdown_lens::geometry::lens::LensModel;

pub(super) fn write(calibration: &NativeCalibration) -> Option<String> {
    let lens = &calibration.lens;
    let (model, intrinsics, distortion, coefficients) =
        if let Some((pinhole, k, skew)) = kannala_brandt(lens) {
            without(skew)?;
            ("pinhole", pinhole.to_vec(), "equidistant", k.to_vec())
        } else if let LensModel::Mei(_) = lens {
            let ([fx, fy, cx, cy], xi, bent, skew) = mei(lens)?;
            without(skew)?;
            ("omni", vec![xi, fx, fy, cx, cy], "radtan", bent.to_vec())
        } else if let LensModel::DoubleSphere(sphere) = lens {
            let [fx, fy, cx, cy] = sphere.pinhole();
            let parameters = vec![sphere.xi, sphere.alpha, fx, fy, cx, cy];
            ("ds", parameters, "none", Vec::new())
        } else if let LensModel::Fov(fov) = lens {
            let pinhole = fov.pinhole().to_vec();
            ("pinhole", pinhole, "fov", vec![fov.omega])
        } else if let Some(([fx, fy, cx, cy], alpha, beta)) = eucm(lens) {
            let parameters = vec![alpha, beta, fx, fy, cx, cy];
            ("eucm", parameters, "none", Vec::new())
        } else {
            ("pinhole", rectilinear(lens)?.to_vec(), "none", Vec::new())
        };
    Some(format!(
        "cam0:\n  cam_overlaps: []\n  camera_model: {model}\n  distortion_coeffs: [{}]\n  \
         distortion_model: {distortion}\n  intrinsics: [{}]\n  resolution: [{}, {}]\n  rostopic: \
         /{}/image_raw\n",
        join(&coefficients, ", "),
        join(&intrinsics, ", "),
        calibration.image.width,
        calibration.image.height,
        calibration.id,
    ))
}

fn without(skew: f64) -> Option<()> {
    (skew == 0.0).then_some(())
}
