//! Errors about parameters, in the same words wherever parameters are read.

use std::{fmt::Display, ops::RangeInclusive, str::FromStr};

use crate::quoted::{Quoted, shortened};

/// A parameter that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{name}: {problem}")]
pub struct ParameterError {
    /// The parameter's name.
    pub name: String,
    /// One sentence: the value, and what would be right.
    pub problem: String,
    /// The kind of error.
    pub fault: ParameterFault,
}

/// The ways in which a parameter can be wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterFault {
    /// There is no such parameter.
    UnknownName,
    /// It was given more than once.
    Repeated,
    /// Its value is out of range or no value of its kind.
    BadValue,
}

impl ParameterError {
    /// There is none of this name; `problem` lists those that there are.
    #[must_use]
    pub fn unknown(name: &str, problem: String) -> Self {
        Self::new(name, problem, ParameterFault::UnknownName)
    }

    /// It was given more than once.
    #[must_use]
    pub fn repeated(name: &str) -> Self {
        let problem = "it is given twice: give it once".to_owned();
        Self::new(name, problem, ParameterFault::Repeated)
    }

    /// Its value cannot be used, for the reason given.
    #[must_use]
    pub fn bad_value(name: &str, problem: String) -> Self {
        Self::new(name, problem, ParameterFault::BadValue)
    }

    /// Its value breaks `rule`, which completes "… is not".
    #[must_use]
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
