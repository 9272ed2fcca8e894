//! The calibration of a `DepthAI` device (`cameraData`: pairs of a socket and a camera). A camera
//! has 14 coefficients; of those of a fisheye (`cameraType` 1) the first four count, as in
//! `cv::fisheye`.

use serde_json::Value;

use super::{
    Camera, FileCamera, FormatError, camera_matrix::CameraMatrix, distortion::Distortion,
    fields::Fields,
};

pub(super) fn read(fields: &Fields<'_>) -> Result<Vec<FileCamera>, FormatError> {
    let mut cameras = Vec::new();
    for pair in fields.get("cameraData")?.as_array().into_iter().flatten() {
        let (Some(socket), Some(camera)) = (pair.get(0), pair.get(1).and_then(Value::as_object))
        else {
            return Err(fields.invalid("cameraData", "pairs of a socket and a camera are needed"));
        };
        let socket = socket.to_string();
        cameras.push(FileCamera {
            camera: read_camera(&fields.inside(&format!("cameraData[{socket}]"), camera)),
            name: Some(socket),
        });
    }
    Ok(cameras)
}

fn read_camera(camera: &Fields<'_>) -> Result<Camera, FormatError> {
    let image = camera.image("width", "height")?;
    let matrix = CameraMatrix::read(camera, "intrinsicMatrix")?;
    let mut values = camera.numbers("distortionCoeff")?;
    let is_fisheye = camera.number_or("cameraType", 0.0)? == 1.0;
    let distortion = if is_fisheye {
        values.truncate(4);
        Distortion::Fisheye
    } else {
        Distortion::RadialTangential
    };
    let lens = matrix.lens(
        distortion,
        &values,
        camera,
        ("cameraType", "distortionCoeff"),
    )?;
    Ok(Camera::new(Some(image), lens))
}
