//! Calibrations from files of all formats.

use std::{path::PathBuf, sync::Arc};

use lookdown_lens::calibration::{Calibration, CalibrationFile, read_content};
use pyo3::prelude::*;

use crate::{
    error::{LookdownError, python_error},
    lens::PyLens,
};

/// A camera: its lens, mount, zones and masks.
#[pyclass(name = "Calibration", module = "lookdown", frozen)]
pub(crate) struct PyCalibration(pub Arc<Calibration>);

#[pymethods]
impl PyCalibration {
    /// Reads a calibration file of any format. `camera` names one of several cameras of a file.
    #[staticmethod]
    #[pyo3(signature = (path, camera=None))]
    fn read(py: Python<'_>, path: PathBuf, camera: Option<&str>) -> PyResult<Self> {
        let calibration = py.detach(|| match camera {
            None => Calibration::read(&path).map_err(python_error),
            Some(camera) => read_camera(&path, camera),
        })?;
        Ok(Self(Arc::new(calibration)))
    }

    /// The ID, from the file or its name.
    #[getter]
    fn id(&self) -> &str {
        self.0.id().as_str()
    }

    /// Twelve hexadecimal digits that change with the content of the file.
    #[getter]
    fn revision(&self) -> &str {
        self.0.revision()
    }

    /// Width and height of the frames, pixels.
    #[getter]
    fn image_size(&self) -> (u32, u32) {
        self.0.image_size()
    }

    /// Height of the camera above the floor, meters, if the file has it.
    #[getter]
    fn height_m(&self) -> Option<f64> {
        self.0.mount().height_m()
    }

    /// The lens, in pixels of frames of `image_size`.
    #[getter]
    fn lens(&self) -> PyLens {
        PyLens(self.0.lens().clone())
    }

    fn __repr__(&self) -> String {
        let (width, height) = self.0.image_size();
        format!(
            "Calibration(id={:?}, lens={:?}, image_size=({width}, {height}))",
            self.0.id().as_str(),
            self.0.lens().model()
        )
    }
}

/// Reads one camera of a file, by its ID.
fn read_camera(path: &std::path::Path, camera: &str) -> PyResult<Calibration> {
    let content = read_content(path).map_err(python_error)?;
    let file = CalibrationFile::parse(&content).map_err(python_error)?;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let cameras = file.calibrations(&stem, &content);
    let ids: Vec<_> = cameras.iter().map(|(id, _)| id.clone()).collect();
    let found = cameras.into_iter().find(|(id, _)| id == camera);
    let (_, calibration) = found.ok_or_else(|| {
        LookdownError::new_err(format!(
            "camera: the file holds {}, not {camera:?}",
            ids.join(", ")
        ))
    })?;
    calibration.map_err(python_error)
}
