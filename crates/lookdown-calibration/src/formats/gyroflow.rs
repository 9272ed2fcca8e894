//! Lens profiles of gyroflow (<https://docs.gyroflow.xyz/app/technical-details/lens-profiles>):
//! `cv::fisheye` in `fisheye_params`, for frames of `calib_dimension`. A project file has the
//! profile in `calibration_data`.
//!
//! The matrix of an anamorphic lens is that of the stretched frame.

use super::{
    Camera, FormatError, camera_matrix::CameraMatrix, distortion::Distortion, fields::Fields,
};

pub(super) fn read(fields: &Fields<'_>) -> Result<Camera, FormatError> {
    let profile = fields.or_child("calibration_data")?;
    for (key, known) in [("distortion_model", "opencv_fisheye"), ("digital_lens", "")] {
        let value = profile.text(key).unwrap_or_default();
        if !value.is_empty() && value != known {
            let problem = format!(
                "it is {value:?}: only profiles of opencv_fisheye without a \
                 digital lens are read"
            );
            return Err(profile.invalid(key, problem));
        }
    }
    let lens = profile.child("fisheye_params")?;
    let mut matrix = CameraMatrix::read(&lens, "camera_matrix")?;
    let mut size = profile.child("calib_dimension")?.image("w", "h")?;
    let stretches = ["input_horizontal_stretch", "input_vertical_stretch"];
    for (axis, side) in [&mut size.width, &mut size.height].into_iter().enumerate() {
        // 0 stands for no stretch.
        let stretch = match profile.number_or(stretches[axis], 1.0)? {
            stretch if stretch > 0.01 => stretch,
            _ => 1.0,
        };
        matrix.pinhole[axis] /= stretch;
        matrix.pinhole[axis + 2] /= stretch;
        *side = super::fields::whole_pixels((f64::from(*side) / stretch).round()).unwrap_or(0);
    }
    let values = lens.numbers("distortion_coeffs")?;
    let names = ("distortion_model", "distortion_coeffs");
    let lens = matrix.lens(Distortion::Fisheye, &values, &lens, names)?;
    Ok(Camera::new(Some(size), lens))
}
