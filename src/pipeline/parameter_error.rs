//! What is wrong with a parameter, in the same words wherever parameters are read.

use std::{fmt::Display, ops::RangeInclusive, str::FromStr};

/// Most characters of a name or a value that are repeated to its sender.
const MAX_SHOWN_CHARS: usize = 64;

/// A parameter that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{name}: {problem}")]
pub struct ParameterError {
    /// The parameter's name.
    pub name: String,
    /// One sentence: the value, and what would be right.
    pub problem: String,
    /// What is wrong with it.
    pub fault: ParameterFault,
}

/// What is wrong with a parameter.
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
    /// There is none of this name; `problem` says which there are.
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

    /// Its value is of no use, for the reason given.
    #[must_use]
    pub fn bad_value(name: &str, problem: String) -> Self {
        Self::new(name, problem, ParameterFault::BadValue)
    }

    /// Its value is not what it has to be.
    #[must_use]
    pub fn is_not(name: &str, value: &str, rule: &str) -> Self {
        Self::bad_value(name, format!("{:?} is not {rule}", shown(value)))
    }

    fn new(name: &str, problem: String, fault: ParameterFault) -> Self {
        Self {
            // Enough to recognise a made-up name by, not enough to fill a log.
            name: shown(name),
            problem,
            fault,
        }
    }
}

/// As much of a value as helps its sender.
#[must_use]
pub fn shown(value: &str) -> String {
    value.chars().take(MAX_SHOWN_CHARS).collect()
}

/// The value of a parameter that is a whole number within a range.
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
