//! Calibrations from files of all formats.

use std::{path::PathBuf, sync::Arc};

use lookdown_calibration::{
    Calibration, export::Target, formats::Camera, native::NativeImage, read_camera,
};
use pyo3::prelude::*;

use crate::{error::python_error, lens::PyLens};

/// A camera: its lens, mount, zones and masks.
#[pyclass(name = "Calibration", module = "lookdown", frozen)]
pub(crate) struct PyCalibration {
    pub camera: Arc<Calibration>,
    /// The native file, JSON.
    pub file: String,
}

#[pymethods]
impl PyCalibration {
    /// Reads a calibration file of any format. `camera` names one of several cameras of a file.
    #[staticmethod]
    #[pyo3(signature = (path, camera=None))]
    fn read(py: Python<'_>, path: PathBuf, camera: Option<&str>) -> PyResult<Self> {
        py.detach(|| {
            let (calibration, stated) = read_camera(&path, camera).map_err(python_error)?;
            Ok(Self {
                file: native_file(&calibration, &stated)?,
                camera: Arc::new(calibration),
            })
        })
    }

    /// The ID, from the file or its name.
    #[getter]
    fn id(&self) -> &str {
        self.camera.id().as_str()
    }

    /// Twelve hexadecimal digits that change with the content of the file.
    #[getter]
    fn revision(&self) -> &str {
        self.camera.revision()
    }

    /// The calibration in the native format, JSON, whatever format its file has.
    fn to_json(&self) -> &str {
        &self.file
    }

    /// Width and height of the frames, pixels.
    #[getter]
    fn image_size(&self) -> (u32, u32) {
        self.camera.image_size()
    }

    /// Height of the camera above the floor, meters, if the file has it.
    #[getter]
    fn height_m(&self) -> Option<f64> {
        self.camera.mount().height_m()
    }

    /// The lens, in pixels of frames of `image_size`.
    #[getter]
    fn lens(&self) -> PyLens {
        PyLens(self.camera.lens().clone())
    }

    fn __repr__(&self) -> String {
        let (width, height) = self.camera.image_size();
        format!(
            "Calibration(id={:?}, lens={:?}, image_size=({width}, {height}))",
            self.camera.id().as_str(),
            self.camera.lens().model()
        )
    }
}

/// Returns the native file of a calibration with this description.
fn native_file(calibration: &Calibration, stated: &Camera) -> PyResult<String> {
    let (width, height) = calibration.image_size();
    let id = calibration.id().to_string();
    let native = stated.to_native(id, NativeImage { width, height });
    let written = Target::Native.write(&native).map_err(python_error)?;
    Ok(written.content)
}
