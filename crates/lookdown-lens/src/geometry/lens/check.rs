//! Checks of lens parameters; every refusal names the parameter and its value.

use super::LensError;

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
