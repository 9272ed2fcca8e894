//! OpenCV's `FileStorage` YAML: `cv::fisheye`, `cv::omnidir`, or a camera without distortion.

use std::fmt::Write;

use super::{
    decimal::{Decimal, join},
    equivalents::{kannala_brandt, mei, rectilinear},
};
use crate::native::NativeCalibration;
use lookdown_lens::geometry::lens::Pinhole;

pub(super) fn write(calibration: &NativeCalibration) -> Option<String> {
    let lens = &calibration.lens;
    let (said, pinhole, skew, coefficients) = if let Some((pinhole, k, skew)) = kannala_brandt(lens)
    {
        ("fisheye_model: 1".to_owned(), pinhole, skew, k.to_vec())
    } else if let Some((pinhole, xi, distortion, skew)) = mei(lens) {
        let said = format!("xi: {}", Decimal(xi));
        (said, pinhole, skew, distortion.to_vec())
    } else {
        let said = "fisheye_model: 0".to_owned();
        (said, rectilinear(lens)?, 0.0, vec![0.0; 5])
    };
    // Every OpenCV reads this directive; 5 writes another one.
    let mut content = format!(
        "%YAML:1.0\n---\nimage_width: {}\nimage_height: {}\n{said}\n",
        calibration.image.width, calibration.image.height
    );
    let camera_matrix = camera_matrix(pinhole, skew);
    matrix(&mut content, "camera_matrix", 3, &camera_matrix);
    matrix(&mut content, "distortion_coefficients", 1, &coefficients);
    Some(content)
}

/// The 3×3 matrix, row by row.
pub(super) fn camera_matrix([fx, fy, cx, cy]: Pinhole, skew: f64) -> [f64; 9] {
    [fx, skew, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
}

fn matrix(content: &mut String, name: &str, rows: usize, data: &[f64]) {
    let columns = data.len() / rows;
    // Writing to a String cannot fail.
    let _ = write!(
        content,
        "{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [ {} ]\n",
        join(data, ", ")
    );
}
