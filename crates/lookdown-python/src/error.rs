//! The exception of the package. Its text is the sentence of the Rust error.

use std::fmt::Display;

use pyo3::{PyErr, create_exception, exceptions::PyValueError};

create_exception!(
    lookdown,
    LookdownError,
    PyValueError,
    "A value, file or frame that cannot be used. The text names it and the remedy."
);

/// Converts an error to [`LookdownError`].
pub(crate) fn python_error(error: impl Display) -> PyErr {
    LookdownError::new_err(format!("{error:#}"))
}
