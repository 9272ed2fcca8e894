//! The parameters of a detection request: those that it gives, completed with the defaults of its
//! calibration and of the server.

use lookdown_detect::parameters::{DefaultSource, DetectParameters, ParameterError};
use lookdown_lens::calibration::CalibrationId;

use super::ApiState;

/// Checks the parameters of a request. `protocol` has the defaults of the request's protocol, which
/// apply where neither the calibration nor the server has one.
pub(super) fn detect_parameters<'a>(
    state: &ApiState,
    mut given: Vec<(&'a str, &'a str)>,
    protocol: &[(&'a str, &'a str)],
) -> Result<DetectParameters, ParameterError> {
    let mut named = given.iter();
    let id = named.find(|(name, _)| *name == DetectParameters::CALIBRATION);
    // An invalid ID is refused below, an unknown one by the engine.
    let id = id.and_then(|(_, id)| id.parse::<CalibrationId>().ok());
    let camera = id.and_then(|id| state.calibrations.entry(&id));
    let server = &state.options.detect_defaults;
    let mut layers = Vec::with_capacity(2);
    if let Some(camera) = &camera {
        layers.push((DefaultSource::Calibration, &camera.defaults));
    }
    layers.push((DefaultSource::Server, server));
    for (name, value) in protocol {
        let is_given = given.iter().any(|(known, _)| known == name);
        if !is_given && !layers.iter().any(|(_, defaults)| defaults.has(name)) {
            given.push((name, value));
        }
    }
    DetectParameters::parse_with(given, &layers)
}
