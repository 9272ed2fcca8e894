//! Errors about parameters, with the same wording in every interface.

use std::{fmt::Display, ops::RangeInclusive, str::FromStr};

use lookdown_common::text::{Quoted, shortened};

/// A parameter that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{name}: {problem}")]
pub struct ParameterError {
    /// The parameter's name.
    pub name: String,
    /// The value and the rule that it breaks, in one sentence.
    pub problem: String,
    /// The kind of error.
    pub fault: ParameterFault,
}

/// The ways in which a parameter can be wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterFault {
    /// Unknown parameter.
    UnknownName,
    /// Parameter given more than once.
    Repeated,
    /// Value out of range or of the wrong type.
    BadValue,
}

impl ParameterError {
    /// Creates the error for an unknown name. `problem` lists the known names.
    pub fn unknown(name: &str, problem: String) -> Self {
        Self::new(name, problem, ParameterFault::UnknownName)
    }

    /// Creates the error for a parameter given more than once.
    pub fn repeated(name: &str) -> Self {
        let problem = "it is given twice: give it once".to_owned();
        Self::new(name, problem, ParameterFault::Repeated)
    }

    /// Creates the error for a bad value with its reason.
    pub fn bad_value(name: &str, problem: String) -> Self {
        Self::new(name, problem, ParameterFault::BadValue)
    }

    /// Creates the error for a value that breaks `rule`, which completes "… is not".
    pub fn is_not(name: &str, value: &str, rule: &str) -> Self {
        Self::bad_value(name, format!("{} is not {rule}", Quoted(value)))
    }

    fn new(name: &str, problem: String, fault: ParameterFault) -> Self {
        Self {
            name: shortened(name).to_owned(),
            problem,
            fault,
        }
    }
}

/// Parses a parameter that is a whole number within a range.
///
/// # Errors
/// [`ParameterError`] for anything else.
pub fn whole_number<N: FromStr + PartialOrd + Display>(
    name: &str,
    value: &str,
    range: RangeInclusive<N>,
) -> Result<N, ParameterError> {
    let number = value.parse().ok().filter(|number| range.contains(number));
    number.ok_or_else(|| {
        let (least, most) = range.into_inner();
        let rule = format!("a whole number from {least} to {most}");
        ParameterError::is_not(name, value, &rule)
    })
}
