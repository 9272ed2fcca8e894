//! The compiled part of the Python package `lookdown`: lenses and calibrations on NumPy arrays, the
//! detector, and the command line. `python/lookdown/_lookdown.pyi` describes it for Python.

// PyO3 passes arguments by value.
#![allow(clippy::needless_pass_by_value)]

mod arrays;
mod calibrate;
mod calibration;
mod detector;
mod error;
mod view;

use std::{borrow::Cow, ffi::OsString, path::PathBuf, process::ExitCode};

use lookdown::settings::{PackagedFiles, use_packaged_files};
use lookdown_common::files::{self, MAX_IMAGE_BYTES};
use pyo3::prelude::*;

use crate::error::python_error;

/// Runs the command line. Returns true if it succeeded. Ends the process if a flag is invalid.
#[pyfunction]
fn run(py: Python<'_>, arguments: Vec<OsString>) -> bool {
    let commit = option_env!("LOOKDOWN_COMMIT");
    py.detach(|| lookdown::cli::run(arguments, commit)) == ExitCode::SUCCESS
}

/// Uses the files of the package where settings have their default paths.
#[pyfunction]
fn use_files(library: PathBuf, models: PathBuf) {
    use_packaged_files(PackagedFiles { library, models });
}

/// Returns the content of an image file, within the limits of the command line.
#[pyfunction]
fn read_image(py: Python<'_>, path: PathBuf) -> PyResult<Cow<'static, [u8]>> {
    let content = py.detach(|| files::read(&path, MAX_IMAGE_BYTES));
    let unreadable =
        |error| python_error(format!("image: {} cannot be read: {error}", path.display()));
    content.map(Cow::Owned).map_err(unreadable)
}

#[pymodule]
mod _lookdown {
    #[pymodule_export]
    use super::calibrate::calibrate;
    #[pymodule_export]
    use super::calibration::PyCalibration;
    #[pymodule_export]
    use super::detector::PyDetector;
    #[pymodule_export]
    use super::error::LookdownError;
    #[pymodule_export]
    use super::view::PyView;
    #[pymodule_export]
    use super::{read_image, run, use_files};
    #[pymodule_export]
    use crate::calibration::PyLens;
}
