//! Values by their keys: those of the settings file, and the environment variables that take
//! precedence.
//!
//! The tables of the settings file that are lists: cameras and webhooks.

use std::{collections::BTreeMap, path::Path};

use lookdown_common::{
    StoredFile,
    files::{self, MAX_SETTINGS_BYTES},
    parse_toml,
};
use lookdown_count::WebhookEntry;
use lookdown_watch::CameraEntry;
use serde::Deserialize;
use toml::{Table, Value};

use super::{
    SettingsError,
    entry::{Entry, key_of, unknown},
    form::{Form, Written},
};

/// The values that were given.
#[derive(Default)]
pub(super) struct Values {
    /// Those of the settings file, by their keys.
    file: BTreeMap<String, Value>,
    /// Cameras and webhooks of the settings file.
    pub(super) lists: ListSettings,
    /// Those of the environment and the command line, by their keys.
    variables: BTreeMap<String, String>,
}

impl Values {
    /// The values of `file` and of `environment`; each must be the value of one of the `entries`.
    pub(super) fn read(
        file: Option<&Path>,
        environment: impl IntoIterator<Item = (String, String)>,
        entries: &[Entry],
    ) -> Result<Self, SettingsError> {
        let mut values = Self::default();
        if let Some(path) = file {
            let text = read(path)?;
            let mut table = parse(path, &text)?;
            if let Some(version) = table.remove(StoredFile::KEY) {
                check_version(path, &version)?;
            }
            let lists = LIST_NAMES
                .iter()
                .filter(|name| table.remove(**name).is_some());
            if lists.count() > 0 {
                values.lists = ListSettings::read(&text)?;
            }
            values.add_table("", table, entries)?;
        }
        for (name, value) in environment {
            if let Some(key) = key_of(&name, entries)? {
                values.variables.insert(key, value);
            }
        }
        Ok(values)
    }

    /// Replaces the values of these keys, each as in a variable.
    pub(super) fn override_with(
        &mut self,
        overrides: &[(String, String)],
        entries: &[Entry],
    ) -> Result<(), SettingsError> {
        for (key, value) in overrides {
            if !entries.iter().any(|entry| entry.key == key) {
                return Err(unknown(&format!("--set {key}"), key, entries));
            }
            self.variables.insert(key.clone(), value.clone());
        }
        Ok(())
    }

    fn add_table(
        &mut self,
        parent: &str,
        table: Table,
        entries: &[Entry],
    ) -> Result<(), SettingsError> {
        for (name, value) in table {
            let key = match parent {
                "" => name,
                _ => format!("{parent}.{name}"),
            };
            let is_table = entries.iter().any(|entry| {
                let (above, _) = entry.split();
                above == key || above.starts_with(&format!("{key}."))
            });
            match value {
                Value::Table(table) if is_table => self.add_table(&key, table, entries)?,
                value if entries.iter().any(|entry| entry.key == key) => {
                    self.file.insert(key, value);
                }
                _ => return Err(unknown(&key, &key, entries)),
            }
        }
        Ok(())
    }

    /// The value of `key`; `None` where none was given. A variable that is set to nothing counts as
    /// not given, unless the form refuses an empty value.
    pub(super) fn get<T>(
        &self,
        key: &'static str,
        form: &Form<T>,
    ) -> Result<Option<T>, SettingsError> {
        let variable = self.variables.get(key).map(String::as_str);
        let variable = variable.filter(|text| !text.is_empty() || form.example.is_some());
        let written = match (variable, self.file.get(key)) {
            (Some(text), _) => Written::Variable(text),
            (None, Some(value)) => Written::Toml(value),
            (None, None) => return Ok(None),
        };
        (form.read)(written)
            .map(Some)
            .map_err(|refusal| SettingsError::new(key, || written.shown(), refusal))
    }
}

fn read(path: &Path) -> Result<String, SettingsError> {
    files::read_text(path, MAX_SETTINGS_BYTES).map_err(|source| {
        let path = path.display();
        SettingsError(format!(
            "the settings file {path} cannot be read ({source}): check the path given to --config"
        ))
    })
}

fn parse(path: &Path, text: &str) -> Result<Table, SettingsError> {
    text.parse().map_err(|error: toml::de::Error| {
        let (path, problem) = (path.display(), on_one_line(&error.to_string()));
        SettingsError(format!(
            "the settings file {path} is not valid TOML: {problem}"
        ))
    })
}

fn check_version(path: &Path, version: &Value) -> Result<(), SettingsError> {
    let checked = StoredFile::Settings.check(&version.to_string());
    let path = path.display();
    checked.map_err(|problem| SettingsError(format!("the settings file {path} {problem}")))
}

/// Drops the quoted source lines of a TOML error, which may hold a secret.
fn on_one_line(message: &str) -> String {
    let lines = message.lines().filter(|line| !line.contains('|'));
    lines.collect::<Vec<_>>().join(": ")
}

/// The names of the tables that are lists.
const LIST_NAMES: [&str; 3] = ["cameras", "camera_defaults", "webhooks"];

/// Cameras and webhooks as they are written.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
pub struct ListSettings {
    /// The values of keys that a camera does not have.
    #[serde(default)]
    pub camera_defaults: CameraEntry,
    /// The cameras of `lookdown run` and `lookdown watch`.
    #[serde(default)]
    pub cameras: Vec<CameraEntry>,
    /// The receivers of messages of `lookdown run` and `lookdown count`.
    #[serde(default)]
    pub webhooks: Vec<WebhookEntry>,
}

impl ListSettings {
    /// The lists in the text of a settings file.
    pub(super) fn read(text: &str) -> Result<Self, SettingsError> {
        Ok(parse_toml(
            text,
            "the settings file",
            "docs/configuration.md",
        )?)
    }
}
