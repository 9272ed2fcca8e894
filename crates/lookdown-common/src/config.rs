//! Settings files: reading with limits, secrets, and errors that name the field.

use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;

use crate::{
    Secret,
    files::{self, MAX_SETTINGS_BYTES},
};

/// A setting that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// A file that cannot be read.
    #[error("{field}: {path} cannot be read: {source}: give a readable file of at most 1 MiB")]
    Unreadable {
        /// The setting that names the file.
        field: String,
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// Not TOML, an unknown key, or a value of another type.
    #[error("{field}: {problem}")]
    Malformed {
        /// The place in the file.
        field: String,
        /// The problem and its remedy.
        problem: String,
    },
    /// A value that cannot be used.
    #[error("{field}: {value:?} {remedy}")]
    Value {
        /// The setting.
        field: String,
        /// Its value.
        value: String,
        /// The remedy, as the end of the sentence.
        remedy: String,
    },
    /// A whole file of settings that cannot be used.
    #[error("{0}")]
    File(String),
    /// A missing or secret value.
    #[error("{field}: {problem}")]
    Problem {
        /// The setting.
        field: String,
        /// The problem and its remedy.
        problem: String,
    },
}

impl ConfigError {
    /// Creates the error of a value. `remedy` is the end of the sentence.
    pub fn value(field: &str, value: &(impl ToString + ?Sized), remedy: &str) -> Self {
        Self::Value {
            field: field.to_owned(),
            value: value.to_string(),
            remedy: remedy.to_owned(),
        }
    }

    /// Creates the error of a missing or secret value.
    pub fn problem(field: &str, problem: &impl ToString) -> Self {
        Self::Problem {
            field: field.to_owned(),
            problem: problem.to_string(),
        }
    }
}

/// Parses a settings file in TOML. `whole` names the file in errors, and `page` documents it.
///
/// # Errors
/// [`ConfigError::Malformed`].
pub fn parse_toml<T: DeserializeOwned>(
    text: &str,
    whole: &str,
    page: &str,
) -> Result<T, ConfigError> {
    let malformed = |field: String, error: &toml::de::Error| {
        let line = error.span().map_or(1, |span| {
            let before = text.get(..span.start).unwrap_or_default();
            before.matches('\n').count() + 1
        });
        let message = error.message().trim();
        ConfigError::Malformed {
            field,
            problem: format!("{message} (line {line}): correct the file as {page} describes"),
        }
    };
    let deserializer =
        toml::Deserializer::parse(text).map_err(|error| malformed(whole.to_owned(), &error))?;
    serde_path_to_error::deserialize(deserializer)
        .map_err(|error| malformed(error.path().to_string(), error.inner()))
}

/// Reads a file of at most 1 MiB. Blocks.
///
/// # Errors
/// [`ConfigError::Unreadable`].
pub fn read_file(field: &str, path: &Path) -> Result<Vec<u8>, ConfigError> {
    files::read(path, MAX_SETTINGS_BYTES).map_err(|source| ConfigError::Unreadable {
        field: field.to_owned(),
        path: path.to_owned(),
        source,
    })
}

/// Reads a secret: the first line of a file. Blocks.
///
/// # Errors
/// [`ConfigError`].
pub fn read_secret(field: &str, path: &Path) -> Result<Secret, ConfigError> {
    let content = read_file(field, path)?;
    let text = String::from_utf8_lossy(&content);
    let line = text.lines().next().unwrap_or_default().trim_end();
    if line.is_empty() {
        let remedy = "is an empty file: write the secret on its first line";
        return Err(ConfigError::value(field, &path.display(), remedy));
    }
    Ok(line.into())
}
