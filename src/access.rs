//! Access control: API keys with a name and scopes. Only the digests of keys are stored.
//!
//! The keys of a file or of the environment. No error repeats the input: it may be a key in the
//! wrong position.
//!
//! A key is 256 random bits and cannot be guessed. A plain SHA-256 therefore keeps it safe in a
//! stolen file, and its check takes a microsecond (docs/adr/0004-api-keys.md).

#[cfg(test)]
mod tests;

use std::{
    collections::BTreeMap,
    fmt,
    path::{Path, PathBuf},
    str::FromStr,
    sync::Arc,
};

use anyhow::{Context, anyhow, bail, ensure};
use lookdown_common::{
    LogOnce,
    files::{self, MAX_SETTINGS_BYTES},
    plain_name::is_plain,
};
use lookdown_detect::fairness::PriorityLevel;
use parking_lot::{Mutex, RwLock};
use serde::Deserialize;
use sha2::{Digest, Sha256};
use strum::{Display, EnumString, IntoStaticStr, VariantArray};
use subtle::{Choice, ConditionallySelectable, ConstantTimeEq};
use toml::{Spanned, Value};

/// A group of operations that a key permits.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    Display,
    EnumString,
    IntoStaticStr,
    VariantArray,
    strum::VariantNames,
)]
#[strum(serialize_all = "snake_case")]
pub enum Scope {
    /// Detect persons in frames.
    Detect,
    /// Read calibrations, view plans, results and counts.
    Read,
    /// See the images of views.
    View,
    /// Everything, including changes of calibrations and cameras.
    Admin,
}

impl Scope {
    /// Returns the name, as in files and commands.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// The scopes of one key, in the order of the declaration of [`Scope`]; never none.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Scopes(Vec<Scope>);

impl Scopes {
    /// Creates a set of these scopes. Returns `None` if there is none.
    pub fn new(given: &[Scope]) -> Option<Self> {
        let given = Scope::VARIANTS.iter().filter(|scope| given.contains(scope));
        let given: Vec<_> = given.copied().collect();
        (!given.is_empty()).then_some(Self(given))
    }

    /// Returns true if `wanted` is among them. `admin` includes all.
    pub fn allow(&self, wanted: Scope) -> bool {
        self.0.contains(&wanted) || self.0.contains(&Scope::Admin)
    }

    /// Their names, separated by `separator`.
    pub fn joined(&self, separator: &str) -> String {
        let names: Vec<_> = self.0.iter().map(|scope| scope.name()).collect();
        names.join(separator)
    }
}

/// The problem of a line of another form.
const NOT_A_KEY: &str = "a key is a line of the form name = { scopes = [\"detect\"], sha256 = \
                         \"64 hexadecimal digits\" }, as `lookdown key new` prints it";

/// Most keys: every request is compared with all of them.
const MAX_KEYS: usize = 1000;

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
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for KeyName {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

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
pub struct KeyList {
    keys: Vec<(KeyDigest, Holder)>,
    /// The reasons why lines of the file are not keys. The other lines are.
    pub problems: Vec<String>,
}

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
    /// each, with `highest_priority = 1` to 9 if that is not 5. A line that is not a key gets a
    /// problem.
    ///
    /// # Errors
    /// If the text is not TOML, or has lines of which none is a key.
    pub fn from_toml(text: &str) -> anyhow::Result<Self> {
        let line_at = |start| 1 + text.get(..start).unwrap_or_default().matches('\n').count();
        // The message of the TOML library would quote the line.
        let rows: BTreeMap<String, Spanned<Value>> = toml::from_str(text).map_err(|error| {
            let start = error.span().map_or(0, |span| span.start);
            anyhow!("line {}: {NOT_A_KEY}", line_at(start))
        })?;
        let mut list = Self::default();
        for (name, row) in rows {
            let start = row.span().start;
            if let Err(problem) = list.add_row(&name, row.into_inner()) {
                let line = line_at(start);
                list.problems.push(format!("line {line}: {problem}"));
            }
        }
        match list.problems.first() {
            Some(problem) if list.is_empty() => Err(anyhow!("{problem}")),
            _ => Ok(list),
        }
    }

    /// Adds the keys of another list. A key whose name this list has, or for which it has no room,
    /// gets a problem.
    #[must_use]
    pub fn with(mut self, other: Self) -> Self {
        self.problems.extend(other.problems);
        for (digest, holder) in other.keys {
            let name = holder.name.clone();
            if let Err(problem) = self.push(digest, holder) {
                self.problems.push(format!("{name}: {problem}"));
            }
        }
        self
    }

    /// The number of keys.
    pub fn len(&self) -> usize {
        self.keys.len()
    }

    /// Returns true if there is no key.
    pub fn is_empty(&self) -> bool {
        self.keys.is_empty()
    }

    /// The names and scopes of all keys.
    pub fn holders(&self) -> impl Iterator<Item = &Holder> {
        self.keys.iter().map(|(_, holder)| holder)
    }

    /// Returns the holder of this key, or `None` if the key is unknown. The time depends only on
    /// the number of keys: all are compared in constant time.
    pub fn holder_of(&self, key: &[u8]) -> Option<&Holder> {
        let digest = KeyDigest::new(key);
        let mut found = 0_u64;
        for (position, (known, _)) in (1_u64..).zip(&self.keys) {
            let same: Choice = known.equals(&digest);
            found.conditional_assign(&position, same);
        }
        let index = usize::try_from(found.checked_sub(1)?).ok()?;
        self.keys.get(index).map(|(_, holder)| holder)
    }

    fn add_row(&mut self, name: &str, row: Value) -> anyhow::Result<()> {
        let row = Row::deserialize(row).map_err(|_| anyhow!(NOT_A_KEY))?;
        let scopes: Vec<_> = row.scopes.iter().map(String::as_str).collect();
        let level = row.highest_priority.map(PriorityLevel::new);
        let level = level.map(|level| level.with_context(wrong_priority));
        self.add(name, &scopes, &row.sha256, level.transpose()?)
    }

    fn add_entry(&mut self, entry: &str) -> anyhow::Result<()> {
        let parts: Vec<_> = entry.split(':').collect();
        let (name, scopes, sha256, level) = match parts[..] {
            [name, scopes, sha256] => (name, scopes, sha256, None),
            [name, scopes, sha256, level] => (name, scopes, sha256, Some(level)),
            _ => bail!(
                "it is not of the form name:scope+scope:sha256, as `lookdown key new` prints it"
            ),
        };
        let level = level.map(str::parse::<PriorityLevel>).transpose();
        let level = level.with_context(wrong_priority)?;
        self.add(name, &scopes.split('+').collect::<Vec<_>>(), sha256, level)
    }

    fn add(
        &mut self,
        name: &str,
        scopes: &[&str],
        sha256: &str,
        highest_priority: Option<PriorityLevel>,
    ) -> anyhow::Result<()> {
        let name = name.parse()?;
        let scopes: Result<Vec<Scope>, _> = scopes.iter().map(|scope| scope.parse()).collect();
        let scopes = scopes.ok().and_then(|scopes| Scopes::new(&scopes));
        let scopes =
            scopes.context("give one or more of the scopes detect, read, view and admin")?;
        let digest = KeyDigest::parse(sha256).context(
            "sha256 must be the 64 hexadecimal digits that `lookdown key new` prints, never the key \
             itself",
        )?;
        let holder = Holder {
            name,
            scopes,
            highest_priority: highest_priority.unwrap_or_default(),
        };
        self.push(digest, holder)
    }

    fn push(&mut self, digest: KeyDigest, holder: Holder) -> anyhow::Result<()> {
        let is_known = self.keys.iter().any(|(_, known)| known.name == holder.name);
        ensure!(
            !is_known,
            "its name is used twice: give each key its own name"
        );
        ensure!(
            self.keys.len() < MAX_KEYS,
            "there are more than {MAX_KEYS} keys: remove unused ones"
        );
        self.keys.push((digest, holder));
        Ok(())
    }
}

/// `name:scope+scope:sha256` or `name:scope+scope:sha256:highest_priority`, separated by commas, as
/// an environment variable has them.
impl FromStr for KeyList {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> anyhow::Result<Self> {
        let mut list = Self::default();
        let entries = text.split(',').map(str::trim);
        for entry in entries.filter(|entry| !entry.is_empty()) {
            let position = list.len() + 1;
            let added = list.add_entry(entry);
            added.map_err(|problem| anyhow!("key {position}: {problem}"))?;
        }
        Ok(list)
    }
}

fn wrong_priority() -> String {
    format!(
        "highest_priority must be {} (highest) to {}; without it, it is {}",
        PriorityLevel::HIGHEST,
        PriorityLevel::LOWEST,
        PriorityLevel::DEFAULT
    )
}

/// The prefix of keys, by which secret scanners recognize them.
const PREFIX: &str = "lookdown_";
const BYTES: usize = 32;

/// Returns a new random key: `lookdown_` and 64 hexadecimal digits.
///
/// # Errors
/// If the operating system returns no random numbers.
pub fn new_key() -> Result<String, getrandom::Error> {
    let mut bytes = [0; BYTES];
    getrandom::fill(&mut bytes)?;
    Ok(format!("{PREFIX}{}", hex::encode(bytes)))
}

/// The SHA-256 of a key. Its `Debug` output shows nothing of it.
#[derive(Clone)]
pub struct KeyDigest([u8; BYTES]);

impl KeyDigest {
    /// Computes the digest of a key as it was sent.
    pub fn new(key: &[u8]) -> Self {
        Self(Sha256::digest(key).into())
    }

    /// Parses a digest of 64 hexadecimal digits.
    pub fn parse(text: &str) -> Option<Self> {
        let mut bytes = [0; BYTES];
        hex::decode_to_slice(text, &mut bytes).ok()?;
        Some(Self(bytes))
    }

    /// Returns the digest as 64 hexadecimal digits.
    pub fn hexadecimal(&self) -> String {
        hex::encode(self.0)
    }

    /// Compares in constant time.
    fn equals(&self, other: &Self) -> Choice {
        self.0.ct_eq(&other.0)
    }
}

impl PartialEq for KeyDigest {
    fn eq(&self, other: &Self) -> bool {
        self.equals(other).into()
    }
}

impl fmt::Debug for KeyDigest {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("KeyDigest(…)")
    }
}

/// The current keys.
#[derive(Debug)]
pub struct AccessKeys {
    /// The keys that do not depend on the file.
    lasting: KeyList,
    file: Option<PathBuf>,
    known: RwLock<Arc<KeyList>>,
    /// The last logged problem of the file. Locked while the file is read.
    problem_log: Mutex<LogOnce>,
}

impl AccessKeys {
    /// Creates the keys of `lasting` and of `file`, if one is given.
    ///
    /// # Errors
    /// If the file cannot be used.
    pub fn open(lasting: KeyList, file: Option<&Path>) -> anyhow::Result<Self> {
        let known = match file {
            Some(file) => read(file, &lasting)?,
            None => lasting.clone(),
        };
        Ok(Self {
            lasting,
            file: file.map(Path::to_owned),
            known: RwLock::new(Arc::new(known)),
            problem_log: Mutex::default(),
        })
    }

    /// Reads the file again. If it cannot be used, the keys stay unchanged, and the reason is
    /// logged once.
    pub fn refresh(&self) {
        let Some(file) = &self.file else { return };
        let mut problem_log = self.problem_log.lock();
        match read(file, &self.lasting) {
            Ok(list) => {
                problem_log.clear();
                if *self.known() != list {
                    tracing::info!(keys = list.len(), "the keys have changed");
                    for problem in &list.problems {
                        tracing::error!("{}: {problem}; not a key", file.display());
                    }
                    *self.known.write() = Arc::new(list);
                }
            }
            Err(error) => {
                let problem = error.to_string();
                if problem_log.should_log(&problem) {
                    tracing::error!("{problem}; the previous keys stay in use");
                }
            }
        }
    }

    /// Returns the holder of this key, or `None` if the key is unknown.
    pub fn holder_of(&self, key: &[u8]) -> Option<Holder> {
        self.known().holder_of(key).cloned()
    }

    /// The keys that are known now.
    pub fn known(&self) -> Arc<KeyList> {
        Arc::clone(&self.known.read())
    }
}

fn read(path: &Path, lasting: &KeyList) -> anyhow::Result<KeyList> {
    let (key, file) = ("access.keys_file", path.display());
    let text = files::read_text(path, MAX_SETTINGS_BYTES).map_err(|cause| {
        anyhow!("{key}: {file} cannot be read ({cause}): check its path and its permissions")
    })?;
    let list = KeyList::from_toml(&text);
    let list = list.map_err(|problem| anyhow!("{key}: {file} cannot be used: {problem}"))?;
    Ok(lasting.clone().with(list))
}
