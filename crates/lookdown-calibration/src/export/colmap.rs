//! COLMAP's `cameras.txt` with one camera. It has no skew; its pixel coordinates begin at the
//! corner of the first pixel.

use super::{
    decimal::join,
    equivalents::{eucm, kannala_brandt, rectilinear},
};
use crate::native::NativeCalibration;
use lookdown_lens::geometry::{
    Pixel,
    lens::LensModel,
    pixels::{PixelConvention, cross_half_pixel},
};

pub(super) fn write(calibration: &NativeCalibration) -> Option<String> {
    let lens = &calibration.lens;
    let (model, [fx, fy, cx, cy], rest) = match lens {
        LensModel::Fov(fov) => ("FOV", fov.pinhole(), vec![fov.omega]),
        _ => {
            if let Some((pinhole, k, skew)) = kannala_brandt(lens) {
                (skew == 0.0).then_some(("OPENCV_FISHEYE", pinhole, k.to_vec()))?
            } else if let Some((pinhole, alpha, beta)) = eucm(lens) {
                ("EUCM", pinhole, vec![alpha, beta])
            } else {
                ("PINHOLE", rectilinear(lens)?, Vec::new())
            }
        }
    };
    let center = cross_half_pixel(Pixel::new(cx, cy), PixelConvention::CornerOrigin);
    let mut parameters = vec![fx, fy, center.x, center.y];
    parameters.extend(rest);
    Some(format!(
        "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, \
         PARAMS[]\n# Number of cameras: 1\n1 {model} {} {} {}\n",
        calibration.image.width,
        calibration.image.height,
        join(&parameters, " "),
    ))
}
