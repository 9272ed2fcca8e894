//! Settings files: reading with limits, secrets, and errors that name the field.

use std::{ops::RangeInclusive, path::Path, time::Duration};

use jiff::SignedDuration;
use serde::de::DeserializeOwned;

use crate::{
    Secret,
    files::{self, MAX_SETTINGS_BYTES},
};

/// A setting that cannot be used. The message is one sentence with the field and the remedy.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct ConfigError(pub String);

impl ConfigError {
    /// Creates the error of a value. `remedy` is the end of the sentence.
    pub fn value(field: &str, value: &(impl ToString + ?Sized), remedy: &str) -> Self {
        Self(format!("{field}: {:?} {remedy}", value.to_string()))
    }

    /// Creates the error of a missing or secret value.
    pub fn problem(field: &str, problem: &impl ToString) -> Self {
        Self(format!("{field}: {}", problem.to_string()))
    }
}

/// Names in the settings of other programs, and ours.
const OTHER_NAMES: [(&str, &str); 4] = [
    ("`fps`", "every, the time between two frames, such as 200ms"),
    ("`interval`", "every, such as 200ms"),
    ("`username`", "user"),
    ("`password`", "password_file"),
];

/// Parses a settings file in TOML. `whole` names the file in errors, and `page` documents it.
///
/// # Errors
/// [`ConfigError`].
pub fn parse_toml<T: DeserializeOwned>(
    text: &str,
    whole: &str,
    page: &str,
) -> Result<T, ConfigError> {
    let malformed = |field: &str, error: &toml::de::Error| {
        let line = error.span().map_or(1, |span| {
            let before = text.get(..span.start).unwrap_or_default();
            before.matches('\n').count() + 1
        });
        let message = error.message().trim();
        let given = message.strip_prefix("unknown field ").unwrap_or_default();
        let known = OTHER_NAMES.iter().find(|(name, _)| given.starts_with(name));
        let hint = known.map_or(String::new(), |(_, own)| format!("; use {own}"));
        let problem =
            format!("{message} (line {line}){hint}: correct the file as {page} describes");
        ConfigError::problem(field, &problem)
    };
    let deserializer = toml::Deserializer::parse(text).map_err(|error| malformed(whole, &error))?;
    serde_path_to_error::deserialize(deserializer)
        .map_err(|error| malformed(&error.path().to_string(), error.inner()))
}

/// Reads a file of at most 1 MiB. Blocks.
///
/// # Errors
/// [`ConfigError`].
pub fn read_file(field: &str, path: &Path) -> Result<Vec<u8>, ConfigError> {
    files::read(path, MAX_SETTINGS_BYTES).map_err(|error| {
        let path = path.display();
        let problem =
            format!("{path} cannot be read: {error}: give a readable file of at most 1 MiB");
        ConfigError::problem(field, &problem)
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

/// Parses a duration with its unit, such as `500ms`. Returns `None` outside of the limits.
pub fn parse_duration(text: &str, limits: RangeInclusive<Duration>) -> Option<Duration> {
    let parsed = Duration::try_from(text.parse::<SignedDuration>().ok()?).ok()?;
    limits.contains(&parsed).then_some(parsed)
}

/// Parses the duration of a setting if it is given.
///
/// # Errors
/// [`ConfigError`] for a text that is not a duration within the limits.
pub fn optional_duration(
    field: &str,
    text: Option<&str>,
    limits: RangeInclusive<Duration>,
) -> Result<Option<Duration>, ConfigError> {
    let Some(text) = text else { return Ok(None) };
    let (least, most) = (limits.start().as_secs_f64(), limits.end().as_secs_f64());
    parse_duration(text, limits).map(Some).ok_or_else(|| {
        let remedy =
            format!("is not a duration from {least} s to {most} s: write it like 10s or 500ms");
        ConfigError::value(field, text, &remedy)
    })
}
