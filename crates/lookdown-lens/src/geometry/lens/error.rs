//! Reasons for which a lens cannot be used, and checks of its parameters; every refusal names the
//! parameter and its value.

/// A lens that cannot be used. The message is one sentence with the parameter, its value and what
/// is needed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{problem}")]
pub struct LensError {
    problem: String,
    /// The largest `max_theta`, radians, if that is what is wrong.
    pub limit: Option<f64>,
}

impl LensError {
    pub(super) fn new(problem: impl Into<String>) -> Self {
        Self {
            problem: problem.into(),
            limit: None,
        }
    }

    /// Creates the error of a `max_theta` beyond this limit.
    pub(super) fn beyond(limit: f64, problem: String) -> Self {
        Self {
            problem,
            limit: Some(limit),
        }
    }
}

pub(super) fn finite(name: &'static str, value: f64) -> Result<f64, LensError> {
    all_finite(name, &[value])?;
    Ok(value)
}

pub(super) fn all_finite(name: &'static str, values: &[f64]) -> Result<(), LensError> {
    match values.iter().find(|value| !value.is_finite()) {
        Some(&value) => Err(LensError::new(format!(
            "{name} is {value}: a finite number is needed"
        ))),
        None => Ok(()),
    }
}

pub(super) fn positive(name: &'static str, value: f64) -> Result<f64, LensError> {
    if finite(name, value)? > 0.0 {
        return Ok(value);
    }
    Err(LensError::new(format!(
        "{name} is {value}: it must be greater than 0"
    )))
}

/// Checks a parameter whose accepted values `range` states in words.
pub(super) fn in_range(
    (model, name): (&'static str, &'static str),
    value: f64,
    is_accepted: impl Fn(f64) -> bool,
    range: &'static str,
) -> Result<f64, LensError> {
    if is_accepted(finite(name, value)?) {
        return Ok(value);
    }
    let problem = format!("{name} is {value}: this {model} parameter must be {range}");
    Err(LensError::new(problem))
}

pub(super) fn from_zero_to_one(
    parameter: (&'static str, &'static str),
    value: f64,
) -> Result<f64, LensError> {
    let is_accepted = |value| (0.0..=1.0).contains(&value);
    in_range(parameter, value, is_accepted, "from 0 to 1")
}

pub(super) fn above_minus_one(
    parameter: (&'static str, &'static str),
    value: f64,
) -> Result<f64, LensError> {
    in_range(parameter, value, |value| value > -1.0, "above -1")
}
