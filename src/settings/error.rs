//! Settings that cannot be used.

use std::path::PathBuf;

use super::form::Refusal;

/// Settings that cannot be used: each message names the key, its value and the remedy.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    /// The settings file cannot be read.
    #[error("the settings file {} cannot be read ({source}): check the path given to --config", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// The settings file is not TOML.
    #[error("the settings file {} is not valid TOML: {problem}", path.display())]
    NotToml {
        /// The file.
        path: PathBuf,
        /// The line, and what was expected there.
        problem: String,
    },
    /// The settings file has another version.
    #[error("the settings file {} {problem}", path.display())]
    Version {
        /// The file.
        path: PathBuf,
        /// Its version and the remedy.
        problem: String,
    },
    /// A key or a table that does not exist.
    #[error("{place}: there is no `{name}` {parent}; use one of {known}")]
    Unknown {
        /// The key or the variable.
        place: String,
        /// The part that is unknown.
        name: String,
        /// The table it was expected in.
        parent: String,
        /// The names that exist.
        known: String,
    },
    /// A variable whose name is a setting's but for the number of underscores.
    #[error("the variable {name} is not read: rename it to {right}")]
    MisnamedVariable {
        /// The variable.
        name: String,
        /// The name of the setting's variable.
        right: String,
    },
    /// A value that cannot be used and may hold a secret, so that it is not repeated.
    #[error("{key}: {problem}")]
    Hidden {
        /// The key.
        key: &'static str,
        /// The problem and the remedy.
        problem: String,
    },
    /// A value that cannot be used.
    #[error("{key} is {value}: {remedy}")]
    Value {
        /// The key.
        key: &'static str,
        /// The value as given.
        value: String,
        /// The remedy.
        remedy: String,
    },
    /// A camera, a webhook or a secret that cannot be used.
    #[error(transparent)]
    Part(#[from] lookdown_common::ConfigError),
    /// A file or folder that is not there.
    #[error("{key}: there is no {what} at {}: {remedy}", path.display())]
    Missing {
        /// The key.
        key: &'static str,
        /// The kind of file or folder.
        what: &'static str,
        /// The path.
        path: PathBuf,
        /// The remedy.
        remedy: String,
    },
}

impl SettingsError {
    /// The refusal of the value of `key`, which is `shown` where the refusal lets it be repeated.
    pub(super) fn new(key: &'static str, shown: impl FnOnce() -> String, refusal: Refusal) -> Self {
        match refusal {
            Refusal::Shown(remedy) => Self::value(key, shown(), remedy),
            Refusal::Part(value, remedy) => Self::value(key, value, remedy),
            Refusal::Hidden(problem) => Self::Hidden { key, problem },
        }
    }

    /// A value that cannot be used.
    pub(super) fn value(
        key: &'static str,
        value: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self::Value {
            key,
            value: value.into(),
            remedy: remedy.into(),
        }
    }
}
