//! A setting in the reference, and the error for keys that no setting has.

use super::{SettingsError, form::Form, lists};

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
        known.extend(lists::TABLES);
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
