//! Virtual views as NumPy arrays.

use std::sync::Arc;

use lookdown_calibration::Calibration;
use lookdown_detect::pipeline::PlannedView;
use lookdown_lens::geometry::{Pixel, pixels::to_pixel_center};
use numpy::ndarray::{Array2, arr1, arr2};
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;

/// An upright perspective view of a part of the frame, as the network receives it.
#[pyclass(name = "View", module = "lookdown", frozen)]
pub(crate) struct PyView {
    pub(crate) planned: PlannedView,
    pub(crate) calibration: Arc<Calibration>,
}

#[pymethods]
impl PyView {
    /// Width and height, pixels.
    #[getter]
    fn size(&self) -> (u32, u32) {
        (self.planned.view.width, self.planned.view.height)
    }

    /// Focal length, pixels.
    #[getter]
    fn focal(&self) -> f64 {
        self.planned.view.focal
    }

    /// Principal point, (x, y).
    #[getter]
    fn principal_point(&self) -> (f64, f64) {
        let at = self.planned.view.principal_point();
        (at.x, at.y)
    }

    /// Rotation from the view frame to the camera frame, of shape (3, 3).
    #[getter]
    fn camera_from_view<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let rotation = self.planned.view.camera_from_view.matrix();
        arr2(&[0, 1, 2].map(|row| [0, 1, 2].map(|column| rotation[(row, column)]))).into_pyarray(py)
    }

    /// Direction of the axis in the camera frame, of shape (3,).
    #[getter]
    fn axis<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let rotation = self.planned.view.camera_from_view.matrix();
        arr1(&[0, 1, 2].map(|row| rotation[(row, 2)])).into_pyarray(py)
    }

    /// Border in the frame, clockwise from the top left corner, of shape (N, 2).
    #[getter]
    fn outline<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let corner_origin = &self.planned.outline;
        let pixels: Vec<_> = corner_origin
            .iter()
            .map(|&at| to_pixel_center(at))
            .map(|at| [at.x, at.y])
            .collect();
        arr2(&pixels).into_pyarray(py)
    }

    /// Returns the position in the frame of each pixel of the view, as two arrays of shape (height,
    /// width) for `cv2.remap`. NaN beyond the lens.
    fn maps<'py>(&self, py: Python<'py>) -> (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray2<f32>>) {
        let (view, lens) = (&self.planned.view, self.calibration.lens());
        let (x, y) = py.detach(|| {
            let shape = (view.height as usize, view.width as usize);
            let (mut x, mut y) = (Array2::zeros(shape), Array2::zeros(shape));
            for (((row, column), x), y) in x.indexed_iter_mut().zip(&mut y) {
                let pixel = Pixel::new(column as f64, row as f64);
                let at = lens.project(&view.ray_in_camera(&pixel));
                let at = at.map_or([f64::NAN; 2], |at| [at.x, at.y]);
                #[expect(
                    clippy::cast_possible_truncation,
                    reason = "maps of OpenCV are float32"
                )]
                let [column, row] = at.map(|coordinate| coordinate as f32);
                (*x, *y) = (column, row);
            }
            (x, y)
        });
        (x.into_pyarray(py), y.into_pyarray(py))
    }
}
