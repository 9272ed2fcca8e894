//! The parameters of a detection request: those that it gives, completed with the defaults of its
//! calibration and of the server.

use lookdown_calibration::CalibrationId;
use lookdown_detect::parameters::{DefaultSource, DetectParameters, ParameterError};

use crate::api::ApiState;

/// Checks the parameters of a request. `protocol` has the defaults of the request's protocol, which
/// apply where neither the calibration nor the server has one.
pub(in crate::api) fn detect_parameters<'a>(
    state: &ApiState,
    mut given: Vec<(&'a str, &'a str)>,
    protocol: &[(&'a str, &'a str)],
) -> Result<DetectParameters, ParameterError> {
    let value = |wanted: &str| {
        let mut named = given.iter();
        named.find_map(|(name, value)| (*name == wanted).then_some(*value))
    };
    let entry = |id: &str| state.calibrations.entry(&id.parse::<CalibrationId>().ok()?);
    // An invalid ID is refused below, an unknown one by the engine.
    let calibration = value(DetectParameters::CALIBRATION);
    let mut camera = calibration.and_then(entry);
    if calibration.is_none()
        && let Some(name) = value(DetectParameters::CAMERA)
    {
        // A camera without a calibration uses the calibration of the same name.
        camera = entry(name);
        if camera.is_some() {
            given.push((DetectParameters::CALIBRATION, name));
        }
    }
    let server = &state.options.settings.detect;
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
