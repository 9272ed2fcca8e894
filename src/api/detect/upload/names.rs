//! The parameters that may accompany a frame.

use lookdown_detect::parameters::ParameterError;

use super::form::FieldUse;
use crate::api::{http::problem::Problem, parameters};

/// The names of the frame's field.
const FRAME_NAMES: [&str; 2] = ["img", "image"];

/// Returns `true` if there is a parameter of this name.
pub(super) fn is_parameter(name: &str) -> bool {
    parameters::all().any(|known| known.name == name)
}

/// Returns the use of a field of the form; other fields are refused.
pub(super) fn use_of(name: &str) -> Result<FieldUse, Problem> {
    if FRAME_NAMES.contains(&name) {
        Ok(FieldUse::Frame)
    } else if is_parameter(name) {
        Ok(FieldUse::Parameter)
    } else {
        Err(unknown_parameter(name))
    }
}

/// Returns the problem of any other name.
pub(super) fn unknown_parameter(name: &str) -> Problem {
    let known: Vec<_> = parameters::all().map(|spec| spec.name).collect();
    let problem = format!(
        "there is no such field or parameter: send the frame as `img` or `image`; the parameters are {}",
        known.join(", ")
    );
    ParameterError::unknown(name, problem).into()
}
