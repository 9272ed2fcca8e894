//! Settings that cannot be used.

use std::{fmt::Display, path::Path};

use lookdown_common::ConfigError;

use super::form::Refusal;

/// Settings that cannot be used: each message names the key, its value and the remedy.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct SettingsError(pub(super) String);

impl From<ConfigError> for SettingsError {
    fn from(error: ConfigError) -> Self {
        Self(error.to_string())
    }
}

impl SettingsError {
    /// The refusal of the value of `key`, which is `shown` where the refusal lets it be repeated.
    pub(super) fn new(key: &str, shown: impl FnOnce() -> String, refusal: Refusal) -> Self {
        match refusal {
            Refusal::Shown(remedy) => Self::value(key, shown(), remedy),
            Refusal::Part(value, remedy) => Self::value(key, value, remedy),
            Refusal::Hidden(problem) => Self::hidden(key, problem),
        }
    }

    /// A value that cannot be used.
    pub(super) fn value(key: &str, value: impl Display, remedy: impl Display) -> Self {
        Self(format!("{key} is {value}: {remedy}"))
    }

    /// A value that cannot be used and may hold a secret, so that it is not repeated.
    pub(super) fn hidden(key: &str, problem: impl Display) -> Self {
        Self(format!("{key}: {problem}"))
    }

    /// A file or folder that is not there.
    pub(super) fn missing(key: &str, what: &str, path: &Path, remedy: &str) -> Self {
        Self(format!(
            "{key}: there is no {what} at {}: {remedy}",
            path.display()
        ))
    }
}
