//! NumPy arrays: points and directions of shape (N, 2) and (N, 3), and pixels.

use lookdown_imaging::{Frame, decode::DecodeLimits};
use numpy::ndarray::{Array2, ArrayView1};
use numpy::{PyReadonlyArray2, PyReadonlyArray3};
use pyo3::PyResult;

use crate::error::python_error;

/// Most rows of an array, so that their copies have at most 2 GiB each.
const MAX_ROWS: usize = 1 << 26;

/// Copies the rows of an array with `N` columns, so that they can be read without the interpreter.
pub(crate) fn rows<const N: usize>(
    name: &str,
    array: &PyReadonlyArray2<'_, f64>,
) -> PyResult<Vec<[f64; N]>> {
    let array = array.as_array();
    if array.ncols() != N {
        let (rows, columns) = array.dim();
        return Err(python_error(format!(
            "{name}: the shape is ({rows}, {columns}); give an array of shape (N, {N})"
        )));
    }
    // An array without memory of its own, such as a broadcast one, may have any number of rows.
    if array.nrows() > MAX_ROWS {
        return Err(python_error(format!(
            "{name}: it has {} rows: give at most {MAX_ROWS} at a time",
            array.nrows()
        )));
    }
    let row = |row: ArrayView1<'_, f64>| std::array::from_fn(|column| row[column]);
    Ok(array.rows().into_iter().map(row).collect())
}

/// Converts rows to an array. Missing rows are NaN.
pub(crate) fn array<const N: usize>(rows: &[Option<[f64; N]>]) -> Array2<f64> {
    Array2::from_shape_fn((rows.len(), N), |(row, column)| {
        rows[row].map_or(f64::NAN, |values| values[column])
    })
}

/// Copies RGB pixels of shape (height, width, 3).
pub(crate) fn frame(pixels: &PyReadonlyArray3<'_, u8>) -> PyResult<Frame> {
    let pixels = pixels.as_array();
    let (height, width, channels) = pixels.dim();
    if channels != 3 {
        return Err(python_error(format!(
            "image: the shape is ({height}, {width}, {channels}); give (height, width, 3)"
        )));
    }
    let side = |side: usize| u32::try_from(side).map_err(python_error);
    let (width, height) = (side(width)?, side(height)?);
    // An array without memory of its own, such as a broadcast one, may have any shape.
    let fits = DecodeLimits::default().check((width, height));
    fits.map_err(python_error)?;
    Frame::new(width, height, pixels.iter().copied().collect()).map_err(python_error)
}
