//! The parameters that may accompany a frame.

use lookdown_detect::parameters::ParameterError;

use super::form::FieldUse;
use crate::api::{http::problem::Problem, parameters};

/// The names of the frame's field.
const FRAME_NAMES: [&str; 2] = ["img", "image"];

/// Returns the use of a field of `POST /detect`; other fields are refused.
pub(super) fn use_in_detection(name: &str) -> Result<FieldUse, Problem> {
    let known: Vec<_> = parameters::all().map(|spec| spec.name).collect();
    use_among(&known, name)
}

/// Returns the use of a field of a form with a frame and these parameters; others are refused.
fn use_among(parameters: &[&str], name: &str) -> Result<FieldUse, Problem> {
    if FRAME_NAMES.contains(&name) {
        Ok(FieldUse::Frame)
    } else if parameters.contains(&name) {
        Ok(FieldUse::Parameter)
    } else {
        let problem = format!(
            "there is no such field or parameter: send the frame as `img` or `image`; the parameters are {}",
            parameters.join(", ")
        );
        Err(ParameterError::unknown(name, problem).into())
    }
}

/// Returns the use of a field of a form with one or more frames and these parameters; others are
/// refused.
pub(in crate::api) fn frames_among(parameters: &[&str], name: &str) -> Result<FieldUse, Problem> {
    let field_use = use_among(parameters, name)?;
    Ok(match field_use {
        FieldUse::Frame => FieldUse::Frames,
        other => other,
    })
}

/// Returns the problem of a frame in the query.
pub(super) fn frame_in_query(name: &str) -> Problem {
    let problem = "it is in the query: send the frame as the body or in a form".to_owned();
    ParameterError::unknown(name, problem).into()
}
