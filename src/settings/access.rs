//! Who may do what, as it is written and checked.

use std::path::PathBuf;

use serde::Deserialize;
use url::{Origin, Url};

use super::{AccessSettings, SettingsError, check::poll_seconds, unshown::Unshown};
use crate::access::{KeyError, KeyList};

/// Table `access`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct RawAccess {
    keys: Unshown,
    keys_file: String,
    poll_seconds: u64,
    cors_origins: String,
}

impl Default for RawAccess {
    fn default() -> Self {
        Self {
            keys: Unshown::default(),
            keys_file: String::new(),
            poll_seconds: 2,
            cors_origins: String::new(),
        }
    }
}

impl TryFrom<RawAccess> for AccessSettings {
    type Error = SettingsError;

    fn try_from(raw: RawAccess) -> Result<Self, SettingsError> {
        let keys: Result<KeyList, KeyError> = raw.keys.0.parse();
        let origins = raw.cors_origins.split(',').map(str::trim);
        let origins = origins.filter(|origin| !origin.is_empty());
        Ok(Self {
            keys: keys.map_err(|error| SettingsError::Refused {
                key: "access.keys".to_owned(),
                problem: error.to_string(),
            })?,
            keys_file: (!raw.keys_file.is_empty()).then(|| PathBuf::from(raw.keys_file)),
            poll_seconds: poll_seconds("access.poll_seconds", raw.poll_seconds)?,
            cors_origins: origins.map(origin).collect::<Result<_, _>>()?,
        })
    }
}

/// An origin as browsers write it, or nothing that any browser would send.
fn origin(text: &str) -> Result<String, SettingsError> {
    let url = Url::parse(text).ok();
    let origin = url.map(|url| url.origin());
    match origin {
        Some(origin @ Origin::Tuple(..)) if origin.ascii_serialization() == text => {
            Ok(text.to_owned())
        }
        _ => Err(SettingsError::Value {
            key: "access.cors_origins".to_owned(),
            value: format!("{text:?}"),
            remedy: "give scheme, host and, unless it is the usual one, port, such as \
                     https://dashboard.example, with nothing behind them"
                .to_owned(),
        }),
    }
}
