//! Settings that cannot be used.

use std::path::PathBuf;

/// Settings that cannot be used: each message names the key, its value and what to do.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    /// The settings file cannot be read.
    #[error("the settings file {} cannot be read ({source}): check the path given to --config", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The settings file is not TOML.
    #[error("the settings file {} is not valid TOML: {problem}", path.display())]
    NotToml {
        /// The file.
        path: PathBuf,
        /// Where, and what was expected there.
        problem: String,
    },
    /// A key that does not exist, or a value of another shape than its key's.
    #[error("{key}: {problem}; check the settings file and the LOOKDOWN__ variables")]
    Refused {
        /// The key, or the table it was expected in.
        key: String,
        /// What is wrong, with the keys there are.
        problem: String,
    },
    /// A value that cannot be used.
    #[error("{key} is {value}: {remedy}")]
    Value {
        /// The key.
        key: String,
        /// The value as given.
        value: String,
        /// What would be right.
        remedy: String,
    },
    /// A file or folder that is not there.
    #[error("{key}: there is no {what} at {}: {remedy}", path.display())]
    Missing {
        /// The key.
        key: &'static str,
        /// What was looked for.
        what: &'static str,
        /// Where it was looked for.
        path: PathBuf,
        /// What to do.
        remedy: String,
    },
}
