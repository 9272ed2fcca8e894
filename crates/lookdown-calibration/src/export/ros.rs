//! ROS `camera_info` YAML: `equidistant`, or `plumb_bob` without distortion.

use super::{
    decimal::join,
    equivalents::{kannala_brandt, rectilinear},
    opencv::camera_matrix,
};
use crate::native::NativeCalibration;

pub(super) fn write(calibration: &NativeCalibration) -> Option<String> {
    let lens = &calibration.lens;
    let (model, pinhole, skew, coefficients) =
        if let Some((pinhole, k, skew)) = kannala_brandt(lens) {
            ("equidistant", pinhole, skew, k.to_vec())
        } else {
            ("plumb_bob", rectilinear(lens)?, 0.0, vec![0.0; 5])
        };
    let matrix = camera_matrix(pinhole, skew);
    // Each row of the projection ends with a translation, here none.
    let projection: Vec<f64> = matrix
        .chunks(3)
        .flat_map(|row| [row, &[0.0]].concat())
        .collect();
    Some(format!(
        "image_width: {}\nimage_height: {}\ncamera_name: {}\ncamera_matrix:\n  rows: 3\n  cols: 3\n  \
         data: [{}]\ndistortion_model: {model}\ndistortion_coefficients:\n  rows: 1\n  cols: {}\n  \
         data: [{}]\nrectification_matrix:\n  rows: 3\n  cols: 3\n  data: [{}]\n\
         projection_matrix:\n  rows: 3\n  cols: 4\n  data: [{}]\n",
        calibration.image.width,
        calibration.image.height,
        calibration.id,
        join(&matrix, ", "),
        coefficients.len(),
        join(&coefficients, ", "),
        join(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], ", "),
        join(&projection, ", "),
    ))
}
