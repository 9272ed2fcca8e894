//! Values as they are written, and the refusal of one.

/// A value as it is written.
#[derive(Clone, Copy)]
pub(in crate::settings) enum Written<'a> {
    /// In the settings file.
    Toml(&'a toml::Value),
    /// In an environment variable.
    Variable(&'a str),
}

impl<'a> Written<'a> {
    /// The text of a variable or of a TOML string.
    pub(super) fn text(self) -> Option<&'a str> {
        match self {
            Self::Toml(value) => value.as_str(),
            Self::Variable(text) => Some(text),
        }
    }

    /// The whole number, which may also be in a string.
    pub(super) fn whole(self) -> Option<u64> {
        match self {
            Self::Toml(toml::Value::Integer(number)) => u64::try_from(*number).ok(),
            _ => self.text()?.trim().parse().ok(),
        }
    }

    /// The number, which may also be in a string.
    pub(super) fn number(self) -> Option<f64> {
        match self {
            Self::Toml(toml::Value::Float(number)) => Some(*number),
            Self::Toml(toml::Value::Integer(number)) => Some(*number as f64),
            _ => self.text()?.trim().parse().ok(),
        }
    }

    /// The value as a message shows it.
    pub(in crate::settings) fn shown(self) -> String {
        match self.text() {
            Some("") => "empty".to_owned(),
            Some(text) => format!("{text:?}"),
            None => match self {
                Self::Toml(value) => value.to_string().replace('\n', " "),
                Self::Variable(text) => text.to_owned(),
            },
        }
    }
}

/// The refusal of a value.
#[derive(Debug)]
pub(in crate::settings) enum Refusal {
    /// The remedy for a value that the message repeats.
    Shown(String),
    /// The remedy for a part of the value, which the message repeats.
    Part(String, String),
    /// The problem with a value that the message does not repeat, since it may hold a secret.
    Hidden(String),
}
