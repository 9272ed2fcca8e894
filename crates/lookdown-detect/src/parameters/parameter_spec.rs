//! The specification of a request parameter: one row from which the parser, the OpenAPI document,
//! the Open Inference Protocol, the command line and `docs/parameters.md` are derived.

use std::{fmt::Display, ops::RangeInclusive, str::FromStr};

use lookdown_common::text::{Quoted, is_invisible, shortened};

/// A request parameter.
#[derive(Debug, Clone, Copy)]
pub struct ParameterSpec {
    /// The name in requests; the flag is the same in kebab-case.
    pub name: &'static str,
    /// The accepted values.
    pub kind: ParameterKind,
    /// The value when a request omits the parameter.
    pub default: ParameterDefault,
    /// The meaning, in sentences with Markdown code spans. The first one is the summary.
    pub help: &'static str,
    /// A value for examples.
    pub example: Option<&'static str>,
    /// The interfaces that offer it.
    pub interfaces: &'static [Interface],
}

/// The values of a parameter.
#[derive(Debug, Clone, Copy)]
pub enum ParameterKind {
    /// Any text.
    Text,
    /// A name of 1 to `max_chars` characters without control characters.
    Name {
        /// The maximum number of characters.
        max_chars: usize,
    },
    /// A text checked by the type into which it is parsed.
    Pattern {
        /// A regular expression that the text matches.
        regex: &'static str,
        /// The rule in words, which completes "… is not".
        rule: &'static str,
    },
    /// One of these names.
    Choice(&'static [&'static str]),
    /// A comma-separated list of these names, or a keyword for none of them.
    Choices {
        /// The names.
        names: &'static [&'static str],
        /// The keyword for none of them.
        none: &'static str,
    },
    /// `true` or `false`.
    Switch,
    /// A whole number in this range, both ends included.
    Whole {
        /// The smallest value.
        min: u32,
        /// The largest value.
        max: u32,
    },
    /// A number from 0 to 1.
    Fraction,
    /// A finite number above 0.
    Positive,
    /// An RFC 3339 time.
    Time,
}

/// The value of a parameter that a request does not give.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterDefault {
    /// A value as a request would give it.
    Value(&'static str),
    /// A default that depends on the rest of the request or on the server; in words.
    Described(&'static str),
    /// No value.
    None,
}

/// The ways to give parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interface {
    /// The query and the form of `POST /detect`.
    Http,
    /// Requests to the model `lookdown` of the Open Inference Protocol.
    FrameModel,
    /// Flags of `lookdown detect`.
    CommandLine,
    /// Defaults in a calibration (`detect`) and in the settings (table `detect`).
    Defaults,
}

/// The type of a value in JSON.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JsonType {
    /// A string.
    Text,
    /// `true` or `false`.
    Switch,
    /// A number.
    Number,
}

impl ParameterSpec {
    /// Returns whether an interface offers the parameter.
    pub fn is_offered_by(&self, interface: Interface) -> bool {
        self.interfaces.contains(&interface)
    }

    /// Parses a value of the parameter.
    ///
    /// # Errors
    /// [`ParameterError`] with the accepted values.
    pub fn parse<T: FromStr>(&self, value: &str) -> Result<T, ParameterError> {
        // Python and .NET write True.
        let is_switch = matches!(self.kind, ParameterKind::Switch);
        let lower = is_switch.then(|| value.to_ascii_lowercase());
        let read = lower.as_deref().unwrap_or(value);
        let parsed = self.kind.accepts(value).then(|| read.parse().ok());
        let refused = || ParameterError::is_not(self.name, value, &self.kind.rule());
        parsed.flatten().ok_or_else(refused)
    }
}

impl ParameterKind {
    /// Describes the values so that the text completes "… is not".
    pub fn rule(&self) -> String {
        match *self {
            Self::Text => "a text".to_owned(),
            Self::Name { max_chars } => {
                format!("a name of 1 to {max_chars} characters without control characters")
            }
            Self::Pattern { rule, .. } => rule.to_owned(),
            Self::Choice(names) => format!("one of {}", names.join(", ")),
            Self::Choices { names, none } => {
                let names = names.join(", ");
                format!("{none} or a comma-separated list of {names}")
            }
            Self::Switch => "true or false".to_owned(),
            Self::Whole { min, max } => format!("a whole number from {min} to {max}"),
            Self::Fraction => "a number from 0 to 1".to_owned(),
            Self::Positive => "a finite number above 0".to_owned(),
            Self::Time => {
                "an RFC 3339 time with an offset, such as 2026-11-21T09:30:00Z".to_owned()
            }
        }
    }

    /// Returns the type of the values in JSON.
    pub fn json_type(&self) -> JsonType {
        match self {
            Self::Text
            | Self::Name { .. }
            | Self::Pattern { .. }
            | Self::Choice(_)
            | Self::Choices { .. }
            | Self::Time => JsonType::Text,
            Self::Switch => JsonType::Switch,
            Self::Whole { .. } | Self::Fraction | Self::Positive => JsonType::Number,
        }
    }

    fn accepts(&self, value: &str) -> bool {
        let number = || value.parse::<f64>().ok();
        match *self {
            Self::Text | Self::Pattern { .. } | Self::Switch | Self::Time => true,
            Self::Name { max_chars } => {
                let count = value.chars().count();
                (1..=max_chars).contains(&count) && !value.chars().any(is_invisible)
            }
            Self::Choice(names) => names.contains(&value),
            Self::Choices { names, none } => {
                value == none || value.split(',').all(|name| names.contains(&name))
            }
            Self::Whole { min, max } => {
                let number = value.parse::<u32>();
                number.is_ok_and(|number| (min..=max).contains(&number))
            }
            Self::Fraction => number().is_some_and(|number| (0.0..=1.0).contains(&number)),
            Self::Positive => number().is_some_and(|number| number.is_finite() && number > 0.0),
        }
    }
}

impl JsonType {
    /// Returns the name of the type so that the text completes "… is needed".
    pub fn described(self) -> &'static str {
        match self {
            Self::Text => "a text",
            Self::Switch => "true or false",
            Self::Number => "a number",
        }
    }
}

/// Declares the rows of a table: a constant for each row, and the table of all rows.
#[macro_export]
macro_rules! parameter_table {
    ($(#[$about:meta])* $visibility:vis const $table:ident; $($name:ident = $spec:expr;)+) => {
        $(const $name: $crate::parameters::ParameterSpec = $spec;)+

        $(#[$about])*
        $visibility const $table: &[$crate::parameters::ParameterSpec] = &[$($name),+];
    };
}

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
