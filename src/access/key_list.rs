//! The keys of a file or of the environment.

use std::{collections::BTreeMap, str::FromStr};

use lookdown_detect::fairness::PriorityLevel;
use serde::Deserialize;
use subtle::{Choice, ConditionallySelectable};

use super::{KeyDigest, KeyError, KeyName, Scope, Scopes};

/// Most keys: every request is compared with all of them.
const MAX_KEYS: usize = 1000;

/// The holder of a key: its name, its scopes and its highest priority.
#[derive(Debug, Clone, PartialEq)]
pub struct Holder {
    /// The name of the key.
    pub name: KeyName,
    /// The operations that the key permits.
    pub scopes: Scopes,
    /// The highest priority of its requests.
    pub highest_priority: PriorityLevel,
}

/// Keys by their digests.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct KeyList(Vec<(KeyDigest, Holder)>);

/// A key in a file, stored under its name.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    scopes: Vec<String>,
    sha256: String,
    highest_priority: Option<u32>,
}

impl KeyList {
    /// Parses the keys of a TOML file: a line `name = { scopes = ["detect"], sha256 = "…" }` for
    /// each, with `highest_priority = 1` to 9 if that is not 5.
    ///
    /// # Errors
    /// [`KeyError`] with the line or the key that cannot be used.
    pub fn from_toml(text: &str) -> Result<Self, KeyError> {
        let rows: BTreeMap<String, Row> = toml::from_str(text).map_err(|error| {
            // The message of the TOML library would quote the line.
            let before = error.span().and_then(|span| text.get(..span.start));
            let line = 1 + before.map_or(0, |before| before.matches('\n').count());
            KeyError::Shape { line }
        })?;
        let mut list = Self::default();
        for (name, row) in rows {
            let scopes: Vec<_> = row.scopes.iter().map(String::as_str).collect();
            let position = list.0.len() + 1;
            let level = row.highest_priority;
            let level =
                level.map(|level| PriorityLevel::new(level).ok_or(KeyError::Priority { position }));
            list.add(&name, &scopes, &row.sha256, level.transpose()?)?;
        }
        Ok(list)
    }

    /// Merges two lists.
    ///
    /// # Errors
    /// If they share a name, or have too many keys together.
    pub fn with(mut self, other: &Self) -> Result<Self, KeyError> {
        for (digest, holder) in &other.0 {
            self.push(digest.clone(), holder.clone())?;
        }
        Ok(self)
    }

    /// The number of keys.
    #[must_use]
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns true if there is no key.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The names and scopes of all keys.
    pub fn holders(&self) -> impl Iterator<Item = &Holder> {
        self.0.iter().map(|(_, holder)| holder)
    }

    /// Returns the holder of this key, or `None` if the key is unknown. The time depends only on
    /// the number of keys: all are compared in constant time.
    #[must_use]
    pub fn holder_of(&self, key: &[u8]) -> Option<&Holder> {
        let digest = KeyDigest::new(key);
        let mut found = 0_u64;
        for (position, (known, _)) in (1_u64..).zip(&self.0) {
            let same: Choice = known.equals(&digest);
            found.conditional_assign(&position, same);
        }
        let index = usize::try_from(found.checked_sub(1)?).ok()?;
        self.0.get(index).map(|(_, holder)| holder)
    }

    fn add(
        &mut self,
        name: &str,
        scopes: &[&str],
        sha256: &str,
        highest_priority: Option<PriorityLevel>,
    ) -> Result<(), KeyError> {
        let position = self.0.len() + 1;
        let name = name.parse().map_err(|_| KeyError::Name { position })?;
        let scopes: Result<Vec<Scope>, _> = scopes.iter().map(|scope| scope.parse()).collect();
        let scopes = scopes.ok().and_then(|scopes| Scopes::new(&scopes));
        let scopes = scopes.ok_or(KeyError::Scopes { position })?;
        let digest = KeyDigest::parse(sha256).ok_or(KeyError::Digest { position })?;
        let holder = Holder {
            name,
            scopes,
            highest_priority: highest_priority.unwrap_or_default(),
        };
        self.push(digest, holder)
    }

    fn push(&mut self, digest: KeyDigest, holder: Holder) -> Result<(), KeyError> {
        if self.0.iter().any(|(_, known)| known.name == holder.name) {
            let position = self.0.len() + 1;
            return Err(KeyError::Repeated { position });
        }
        if self.0.len() == MAX_KEYS {
            return Err(KeyError::TooMany { most: MAX_KEYS });
        }
        self.0.push((digest, holder));
        Ok(())
    }
}

/// `name:scope+scope:sha256` or `name:scope+scope:sha256:highest_priority`, separated by commas, as
/// an environment variable has them.
impl FromStr for KeyList {
    type Err = KeyError;

    fn from_str(text: &str) -> Result<Self, KeyError> {
        let mut list = Self::default();
        let entries = text.split(',').map(str::trim);
        for entry in entries.filter(|entry| !entry.is_empty()) {
            let position = list.0.len() + 1;
            let parts: Vec<_> = entry.split(':').collect();
            let (name, scopes, sha256, level) = match parts[..] {
                [name, scopes, sha256] => (name, scopes, sha256, None),
                [name, scopes, sha256, level] => (name, scopes, sha256, Some(level)),
                _ => return Err(KeyError::Entry { position }),
            };
            let level = level.map(str::parse::<PriorityLevel>).transpose();
            let level = level.map_err(|_| KeyError::Priority { position })?;
            list.add(name, &scopes.split('+').collect::<Vec<_>>(), sha256, level)?;
        }
        Ok(list)
    }
}

#[cfg(test)]
mod tests;
