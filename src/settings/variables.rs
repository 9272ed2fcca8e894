//! Names of environment variables: `LOOKDOWN__SERVER__LISTEN` is the key `server.listen`.

use super::{
    SettingsError,
    entry::{Entry, unknown},
};

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
