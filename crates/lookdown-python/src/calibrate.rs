//! A calibration from frames of the camera.

use std::{borrow::Cow, sync::Arc};

use lookdown::room_calibration;
use lookdown_calibration::CalibrationId;
use lookdown_imaging::{
    Frame,
    decode::{DecodeLimits, decode},
};
use numpy::PyReadonlyArray3;
use pyo3::prelude::*;

use crate::{arrays::frame, calibration::PyCalibration, error::python_error};

/// An image: RGB pixels, or the content of a file.
#[derive(FromPyObject)]
pub(crate) enum Image<'py> {
    Pixels(PyReadonlyArray3<'py, u8>),
    Encoded(Vec<u8>),
}

impl Image<'_> {
    fn frame(&self) -> PyResult<Frame> {
        match self {
            Self::Pixels(pixels) => frame(pixels),
            Self::Encoded(content) => {
                let decoded = decode(content, &DecodeLimits::default());
                Ok(decoded.map_err(python_error)?.frame)
            }
        }
    }
}

/// Calibrates a camera from frames of one size. Returns the calibration and the preview of the fit
/// as a JPEG.
#[pyfunction]
#[pyo3(signature = (images, id, height_m=None, lens=None, field_of_view_deg=None, ceiling=false))]
pub(crate) fn calibrate(
    py: Python<'_>,
    images: Vec<Image<'_>>,
    id: &str,
    height_m: Option<f64>,
    lens: Option<&str>,
    field_of_view_deg: Option<f64>,
    ceiling: bool,
) -> PyResult<(PyCalibration, Cow<'static, [u8]>)> {
    let id: CalibrationId = id
        .parse()
        .map_err(|error| python_error(format!("id: {error}")))?;
    let frames = images.iter().map(Image::frame);
    let frames = frames.collect::<PyResult<Vec<_>>>()?;
    let field_of_view_deg = field_of_view_deg.map(|degrees| degrees.to_string());
    let known = room_calibration::known_camera(lens, field_of_view_deg.as_deref(), ceiling);
    let known = known.map_err(python_error)?;
    let found = py.detach(|| room_calibration::calibrate(&id, &frames, known, height_m));
    let found = found.map_err(python_error)?;
    let calibration = PyCalibration {
        camera: Arc::new(found.calibration),
        file: found.file,
    };
    Ok((calibration, Cow::Owned(found.preview)))
}
