//! The ONNX Runtime environment of the process.

use std::{path::Path, sync::OnceLock};

use ort::environment::Environment;
use parking_lot::Mutex;

use crate::inference::InferenceError;

static ENVIRONMENT: OnceLock<Environment> = OnceLock::new();
/// The runtime refuses a second environment, so only one thread may create it.
static LOADING: Mutex<()> = Mutex::new(());

/// Loads the library on the first call. Later calls return the same environment.
pub(super) fn load(library: &Path) -> Result<&'static Environment, InferenceError> {
    let _only_loader = LOADING.lock();
    if let Some(environment) = ENVIRONMENT.get() {
        return Ok(environment);
    }
    let unusable = |detail: String| InferenceError::Runtime {
        path: library.to_owned(),
        detail,
    };
    // A bare path would first be searched beside the executable.
    let library = library
        .canonicalize()
        .map_err(|error| unusable(error.to_string()))?;
    let environment = ort::environment::init_from(&library)
        .map_err(|error| unusable(error.to_string()))?
        .with_name("lookdown")
        // The builds on PyPI record telemetry by default; SECURITY.md.
        .with_telemetry(false)
        .build()
        .map_err(|error| unusable(error.to_string()))?;
    Ok(ENVIRONMENT.get_or_init(|| environment))
}
