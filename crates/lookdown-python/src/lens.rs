//! Projection of many points at once.

use lookdown_lens::geometry::{Lens, Pixel, Ray};
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::arrays::{array, rows};

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
