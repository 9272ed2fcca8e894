//! The detector: the engine of the server in this process.

use std::{collections::BTreeMap, path::PathBuf, sync::Arc};

use lookdown::{api::to_report, app::engine_for, settings};
use lookdown_calibration::Calibration;
use lookdown_detect::{
    parameters::DetectParameters,
    pipeline::{DetectJob, Engine, JobImage},
};
use numpy::PyReadonlyArray3;
use pyo3::prelude::*;

use crate::{arrays::frame, calibration::PyCalibration, error::python_error, view::PyView};

/// Finds persons in frames. May be used by several threads.
#[pyclass(name = "Detector", module = "lookdown._lookdown", frozen)]
pub(crate) struct PyDetector {
    engine: Engine,
    parameters: DetectParameters,
}

#[pymethods]
impl PyDetector {
    /// Loads the models of the parameters, which are those of `POST /detect`. `config` is a
    /// settings file.
    #[new]
    #[pyo3(signature = (parameters, config=None))]
    fn new(
        py: Python<'_>,
        parameters: BTreeMap<String, String>,
        config: Option<PathBuf>,
    ) -> PyResult<Self> {
        let given = parameters.iter();
        let given = given.map(|(name, value)| (name.as_str(), value.as_str()));
        let parameters = DetectParameters::parse(given).map_err(python_error)?;
        py.detach(|| {
            let settings =
                settings::load(config.as_deref(), settings::environment()).map_err(python_error)?;
            let engine =
                engine_for(&settings, std::slice::from_ref(&parameters)).map_err(python_error)?;
            Ok(Self { engine, parameters })
        })
    }

    /// Detects persons in the content of an image file. Returns the report as JSON.
    #[pyo3(signature = (content, name, calibration=None))]
    fn detect_file(
        &self,
        py: Python<'_>,
        content: Vec<u8>,
        name: String,
        calibration: Option<&PyCalibration>,
    ) -> PyResult<String> {
        let calibration = calibration.map(|given| Arc::clone(&given.camera));
        let image = JobImage::Encoded(content.into());
        py.detach(|| self.detect(name, image, calibration))
    }

    /// Detects persons in RGB pixels of shape (height, width, 3). Returns the report as JSON.
    #[pyo3(signature = (pixels, name, calibration=None))]
    fn detect_pixels(
        &self,
        py: Python<'_>,
        pixels: PyReadonlyArray3<'_, u8>,
        name: String,
        calibration: Option<&PyCalibration>,
    ) -> PyResult<String> {
        let calibration = calibration.map(|given| Arc::clone(&given.camera));
        let image = JobImage::Decoded(Arc::new(frame(&pixels)?));
        py.detach(|| self.detect(name, image, calibration))
    }

    /// Returns the views of the profile, in the order in which the network receives them.
    fn views(&self, py: Python<'_>, calibration: &PyCalibration) -> PyResult<Vec<PyView>> {
        let (calibration, profile) = (Arc::clone(&calibration.camera), self.parameters.profile);
        let plan = py.detach(|| self.engine.planned_views(&calibration, profile));
        let views = plan.map_err(python_error)?.views.into_iter();
        let calibration = || Arc::clone(&calibration);
        Ok(views
            .map(|planned| PyView {
                planned,
                calibration: calibration(),
            })
            .collect())
    }
}

impl PyDetector {
    fn detect(
        &self,
        name: String,
        image: JobImage,
        calibration: Option<Arc<Calibration>>,
    ) -> PyResult<String> {
        let mut parameters = self.parameters.clone();
        if let Some(calibration) = &calibration {
            parameters.calibration = Some(calibration.id().clone());
        }
        let job = DetectJob::local(name, image, parameters, calibration);
        let detected = self.engine.detect(&job).map_err(python_error)?;
        serde_json::to_string(&to_report(&detected.report)).map_err(python_error)
    }
}
