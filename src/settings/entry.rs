//! A setting in the reference, and the error for keys that no setting has.
//!
//! Settings that cannot be used.
//!
//! Names of environment variables: `LOOKDOWN__SERVER__LISTEN` is the key `server.listen`.

use std::{fmt::Display, path::Path};

use lookdown_common::ConfigError;

use super::form::{Form, Refusal};

/// The tables of the settings file that are lists, as they are written.
const LIST_TABLES: [&str; 3] = ["[[cameras]]", "[camera_defaults]", "[[webhooks]]"];

/// A setting as the reference shows it.
#[derive(Debug, Clone)]
#[cfg_attr(
    not(test),
    expect(
        dead_code,
        reason = "only the tests that generate the reference read all of it"
    )
)]
pub(super) struct Entry {
    /// The key with its table, such as `server.tls.certificate`.
    pub(super) key: &'static str,
    /// The documentation.
    pub(super) help: String,
    /// The values that are accepted, as a phrase.
    pub(super) kind: String,
    /// The default as TOML.
    pub(super) default: toml::Value,
    /// The value that the settings file shows in a comment, where an empty value is refused.
    pub(super) example: Option<&'static str>,
}

impl Entry {
    pub(super) fn new<T>(key: &'static str, help: &[&str], form: &Form<T>, default: &T) -> Self {
        Self {
            key,
            help: help
                .iter()
                .map(|line| line.trim())
                .collect::<Vec<_>>()
                .join(" "),
            kind: form.kind.clone(),
            default: (form.write)(default),
            example: form.example,
        }
    }

    /// The table and the key in it.
    pub(super) fn split(&self) -> (&'static str, &'static str) {
        self.key.rsplit_once('.').unwrap_or(("", self.key))
    }
}

/// The refusal of a key that does not exist, which stands at `place`.
pub(super) fn unknown(place: &str, key: &str, entries: &[Entry]) -> SettingsError {
    let (above, name) = key.rsplit_once('.').unwrap_or(("", key));
    let is_table = entries.iter().any(|entry| entry.split().0 == above);
    let (parent, mut known): (String, Vec<_>) = if is_table {
        let inside = entries.iter().filter(|entry| entry.split().0 == above);
        (
            format!("in the table `{above}`"),
            inside.map(|entry| entry.split().1).collect(),
        )
    } else {
        (
            "among the tables".to_owned(),
            entries.iter().map(|entry| entry.split().0).collect(),
        )
    };
    known.dedup();
    if !is_table {
        known.extend(LIST_TABLES);
    }
    // Similar names, such as that of the list `cameras` for a table `camera`, come first.
    known.sort_by_key(|known| name.is_empty() || !known.trim_matches('[').starts_with(name));
    let known: Vec<_> = known.iter().map(|name| format!("`{name}`")).collect();
    let known = known.join(", ");
    let name = if is_table || above.is_empty() {
        name
    } else {
        above
    };
    SettingsError(format!(
        "{place}: there is no `{name}` {parent}; use one of {known}"
    ))
}

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

const PREFIX: &str = "LOOKDOWN__";
/// The prefix of variables with a single underscore, which are not settings, such as
/// `LOOKDOWN_PORT=tcp://…`. Kubernetes sets it for a Service called `lookdown`.
const NEARLY: &str = "LOOKDOWN_";
/// The variable with the source of a camera for `lookdown run`, for containers: arguments are shown
/// in lists of processes, and the URL may hold a password.
pub const CAMERA_VARIABLE: &str = "LOOKDOWN_CAMERA";
/// The separator of tables and keys.
const SEPARATOR: &str = "__";

/// The variables of this process that are text.
pub fn environment() -> impl Iterator<Item = (String, String)> {
    std::env::vars_os()
        .filter_map(|(name, value)| Some((name.into_string().ok()?, value.into_string().ok()?)))
}

/// The variable of a key.
pub(crate) fn variable_of(key: &str) -> String {
    format!("{PREFIX}{}", key.replace('.', SEPARATOR).to_uppercase())
}

/// The key that a variable sets; `None` for a variable that is not a setting.
///
/// # Errors
/// Returns an error if there is no such key, or if the name has a single underscore after
/// `LOOKDOWN` and two underscores later: such a name was meant for a setting.
pub(super) fn key_of(name: &str, entries: &[Entry]) -> Result<Option<String>, SettingsError> {
    let upper = name.to_uppercase();
    let key = |rest: &str| rest.to_lowercase().replace(SEPARATOR, ".");
    let is_known = |key: &str| entries.iter().any(|entry| entry.key == key);
    if let Some(rest) = upper.strip_prefix(PREFIX) {
        let key = key(rest);
        return if is_known(&key) {
            Ok(Some(key))
        } else {
            Err(unknown(name, &key, entries))
        };
    }
    match upper.strip_prefix(NEARLY) {
        Some(rest) if rest.contains(SEPARATOR) => {
            let key = key(rest);
            Err(if is_known(&key) {
                let right = variable_of(&key);
                SettingsError(format!(
                    "the variable {name} is not read: rename it to {right}"
                ))
            } else {
                unknown(name, &key, entries)
            })
        }
        _ => Ok(None),
    }
}

/// A sentence on the variables among `names` that begin with `LOOKDOWN_` and are not settings, with
/// the setting that each may have been meant for; `None` when there are none.
pub(super) fn ignored(
    names: impl IntoIterator<Item = String>,
    entries: &[Entry],
) -> Option<String> {
    let ignored = names.into_iter().filter(|name| {
        let upper = name.to_uppercase();
        upper.starts_with(NEARLY) && !upper.starts_with(PREFIX) && name != CAMERA_VARIABLE
    });
    let mut ignored: Vec<_> = ignored
        .map(|name| {
            let upper = name.to_uppercase();
            let mut known = entries.iter().map(|entry| variable_of(entry.key));
            let key = upper.strip_prefix(NEARLY).unwrap_or_default();
            let is_meant = |known: &String| {
                known.replace(SEPARATOR, "_") == upper
                    || known.ends_with(&format!("{SEPARATOR}{key}"))
            };
            let meant = known.find(is_meant);
            match meant {
                Some(meant) => format!("{name} (for the setting, use {meant})"),
                None => name,
            }
        })
        .collect();
    ignored.sort();
    (!ignored.is_empty()).then(|| {
        let names = ignored.join(", ");
        format!("these variables are not settings and are ignored: {names}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_other_variables_are_reported_as_ignored() {
        let names = |names: &[&str]| names.iter().map(ToString::to_string).collect::<Vec<_>>();
        assert_eq!(ignored(names(&[CAMERA_VARIABLE, "PATH"]), &[]), None);
        let found = ignored(names(&[CAMERA_VARIABLE, "LOOKDOWN_PORT"]), &[]).unwrap();
        assert!(found.ends_with("ignored: LOOKDOWN_PORT"), "{found}");
        let found = ignored(names(&["LOOKDOWN_LISTEN"]), &super::super::entries()).unwrap();
        let meant = "LOOKDOWN_LISTEN (for the setting, use LOOKDOWN__SERVER__LISTEN)";
        assert!(found.ends_with(meant), "{found}");
    }
}
