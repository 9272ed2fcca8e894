//! Layers: defaults, settings file, environment.

use std::{collections::HashMap, path::Path};

use config::{Config, ConfigError, Environment, File, FileFormat};

use super::{RawSettings, Settings, SettingsError};

const PREFIX: &str = "LOOKDOWN";
const SEPARATOR: &str = "__";

/// The variables of this process that can be text.
#[must_use]
pub fn environment() -> HashMap<String, String> {
    std::env::vars_os()
        .filter_map(|(name, value)| Some((name.into_string().ok()?, value.into_string().ok()?)))
        .collect()
}

/// Loads and checks the settings: defaults, then `file` (TOML), then `environment`. Variables
/// set to nothing count as not set.
///
/// # Errors
/// [`SettingsError`] when the file cannot be read, a key is unknown or a value cannot be used.
pub fn load(
    file: Option<&Path>,
    environment: impl IntoIterator<Item = (String, String)>,
) -> Result<Settings, SettingsError> {
    let mut builder = Config::builder();
    if let Some(path) = file {
        builder = builder.add_source(File::from_str(&read(path)?, FileFormat::Toml));
    }
    let variables = Environment::with_prefix(PREFIX)
        .prefix_separator(SEPARATOR)
        .separator(SEPARATOR)
        .ignore_empty(true)
        .source(Some(environment.into_iter().collect()));
    let raw: RawSettings = builder
        .add_source(variables)
        .build()
        .and_then(Config::try_deserialize)
        .map_err(|error| explain(error, file))?;
    raw.try_into()
}

fn read(path: &Path) -> Result<String, SettingsError> {
    std::fs::read_to_string(path).map_err(|source| SettingsError::Unreadable {
        path: path.to_owned(),
        source,
    })
}

/// The library's error as one sentence that names the key.
fn explain(error: ConfigError, file: Option<&Path>) -> SettingsError {
    match error {
        ConfigError::FileParse { cause, .. } => SettingsError::NotToml {
            path: file.unwrap_or(Path::new("")).to_owned(),
            problem: on_one_line(&cause.to_string()),
        },
        ConfigError::Type {
            unexpected,
            expected,
            key,
            ..
        } => SettingsError::Value {
            key: key.unwrap_or_default(),
            value: unexpected.to_string(),
            remedy: format!("{expected} is needed"),
        },
        ConfigError::At { error, key, .. } => SettingsError::Refused {
            key: key.unwrap_or_default(),
            problem: error.to_string(),
        },
        other => SettingsError::Refused {
            key: "settings".to_owned(),
            problem: other.to_string(),
        },
    }
}

/// Drops the quoted source lines of a TOML error.
fn on_one_line(message: &str) -> String {
    let lines = message.lines().filter(|line| !line.contains('|'));
    lines.collect::<Vec<_>>().join(": ")
}
