//! Calibrations from files of all formats.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use lookdown_lens::calibration::{
    Calibration, CalibrationFile, export::Target, native::NativeImage, read_content,
};
use pyo3::prelude::*;

use crate::{
    error::{LookdownError, python_error},
    lens::PyLens,
};

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
            let calibration = match camera {
                None => Calibration::read(&path).map_err(python_error)?,
                Some(camera) => read_camera(&path, camera)?,
            };
            Ok(Self {
                file: native_file(&path, &calibration)?,
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

/// Returns the native file of a calibration that was read from this file.
fn native_file(path: &Path, calibration: &Calibration) -> PyResult<String> {
    let content = read_content(path).map_err(python_error)?;
    let file = CalibrationFile::parse(&content).map_err(python_error)?;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let id = calibration.id().to_string();
    let ids = file.calibrations(&stem, &content).into_iter();
    let mut cameras = ids.zip(file.cameras).filter(|((named, _), _)| *named == id);
    let changed = || {
        python_error(format!(
            "{}: the file changed: read it again",
            path.display()
        ))
    };
    let (_, described) = cameras.next().ok_or_else(changed)?;
    let (width, height) = calibration.image_size();
    let native = described.camera.map_err(python_error)?;
    let native = native.to_native(id, NativeImage { width, height });
    let written = Target::Native.write(&native).map_err(python_error)?;
    Ok(written.content)
}

/// Reads one camera of a file, by its ID.
fn read_camera(path: &Path, camera: &str) -> PyResult<Calibration> {
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
