//! `cameras.sfm` of `AliceVision`, which Meshroom shows: `intrinsics[]` with numbers as texts.
//!
//! The focal length is in millimeters of the sensor. The principal point is an offset from the
//! middle of the frame. `fisheye4` has the coefficients of `cv::fisheye`.

use lookdown_lens::geometry::lens::KannalaBrandt;

use super::{Camera, FileCamera, FormatError, camera_matrix::four, fields::Fields};

pub(super) fn read(fields: &Fields<'_>) -> Vec<FileCamera> {
    let id = |camera: &Fields<'_>| camera.text("intrinsicId").ok().map(str::to_owned);
    let cameras = fields.entries("intrinsics").map(|camera| FileCamera {
        name: camera.as_ref().ok().and_then(id),
        camera: camera.and_then(|camera| read_camera(&camera)),
    });
    cameras.collect()
}

fn read_camera(camera: &Fields<'_>) -> Result<Camera, FormatError> {
    let model = ["distortionType", "type"]
        .into_iter()
        .find(|key| camera.text(key).ok() == Some("fisheye4"));
    if model.is_none() {
        let problem = format!(
            "it is {:?}: fisheye4 is read, reconstruct with that model",
            camera.text("type")?
        );
        return Err(camera.invalid("type", problem));
    }
    let image = camera.image("width", "height")?;
    let (width, height) = (f64::from(image.width), f64::from(image.height));
    let [x, y] = camera.exactly("principalPoint", "x and y from the middle")?;
    let focal = camera.number("focalLength")? / camera.number("sensorWidth")? * width;
    if camera.number_or("pixelRatio", 1.0)? != 1.0 {
        return Err(camera.invalid("pixelRatio", "it is not 1: only square pixels are read"));
    }
    let center = [x + (width - 1.0) / 2.0, y + (height - 1.0) / 2.0];
    let k = four(&camera.numbers("distortionParams")?)
        .map_err(|problem| camera.invalid("distortionParams", problem))?;
    let pinhole = [focal, focal, center[0], center[1]];
    Ok(Camera::new(Some(image), KannalaBrandt::new(pinhole, k)))
}
