//! The name of a key.

use std::{fmt, str::FromStr};

use lookdown_common::plain_name::is_plain;

/// The name of a key: 1 to 64 of a-z, 0-9, `_` and `-`, a bare key in TOML.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeyName(String);

/// The text is not a valid name of a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a name is 1 to 64 of a-z, 0-9, _ and -, and begins with a-z or 0-9")]
pub struct InvalidKeyName;

impl FromStr for KeyName {
    type Err = InvalidKeyName;

    fn from_str(name: &str) -> Result<Self, InvalidKeyName> {
        is_plain(name)
            .then(|| Self(name.to_owned()))
            .ok_or(InvalidKeyName)
    }
}

impl KeyName {
    /// The name as text.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for KeyName {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}
