//! Calibrations from files of all formats.

use std::{path::PathBuf, sync::Arc};

use lookdown_calibration::{
    Calibration, export::Target, formats::Camera, native::NativeImage, read_camera,
};
use lookdown_lens::geometry::{Lens, Pixel, Ray};
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::{
    arrays::{array, rows},
    error::python_error,
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

/// A fisheye lens. The center of the top-left pixel is (0, 0); rays are in the camera frame of
/// OpenCV.
#[pyclass(name = "Lens", module = "lookdown", frozen)]
pub(crate) struct PyLens(pub Lens);

#[pymethods]
impl PyLens {
    /// Name of the lens model, such as `kannala_brandt`.
    #[getter]
    fn model(&self) -> &'static str {
        self.0.model()
    }

    /// Largest angle from the optical axis, radians.
    #[getter]
    fn max_theta(&self) -> f64 {
        self.0.max_theta()
    }

    /// Pixel of the optical axis, (x, y).
    #[getter]
    fn principal_point(&self) -> (f64, f64) {
        let at = self.0.principal_point();
        (at.x, at.y)
    }

    /// Projects rays of shape (N, 3) and any length to pixels of shape (N, 2). NaN beyond the lens.
    fn project<'py>(
        &self,
        py: Python<'py>,
        rays: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rays = rows::<3>("rays", &rays)?;
        let pixels = py.detach(|| {
            let pixel = |ray: &[f64; 3]| self.0.project(&Ray::from(*ray)).map(|at| [at.x, at.y]);
            array(&rays.iter().map(pixel).collect::<Vec<_>>())
        });
        Ok(pixels.into_pyarray(py))
    }

    /// Converts pixels of shape (N, 2) to unit rays of shape (N, 3). NaN beyond the lens.
    fn unproject<'py>(
        &self,
        py: Python<'py>,
        pixels: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let pixels = rows::<2>("pixels", &pixels)?;
        let rays = py.detach(|| {
            let ray = |at: &[f64; 2]| self.0.unproject(&Pixel::from(*at)).map(<[f64; 3]>::from);
            array(&pixels.iter().map(ray).collect::<Vec<_>>())
        });
        Ok(rays.into_pyarray(py))
    }

    fn __repr__(&self) -> String {
        let degrees = self.0.max_theta().to_degrees();
        format!("Lens(model={:?}, max_theta={degrees:.1}°)", self.0.model())
    }
}
