//! The settings of the counts, as written and as checked.

use std::{
    net::SocketAddr,
    path::{Path, PathBuf},
    time::Duration,
};

use lookdown_common::{ConfigError, Secret, ServerEntry, ServerOptions, read_secret};
use secrecy::ExposeSecret;

use crate::webhooks::{Webhook, WebhookEntry};

/// Most webhooks.
const MAX_WEBHOOKS: usize = 32;
/// Shortest API key of a reader.
const LEAST_KEY_CHARS: usize = 16;

/// The settings as they are written, with defaults for all others.
#[derive(Debug, Clone, PartialEq)]
pub struct CountEntry {
    /// The server whose reports are counted.
    pub server: ServerEntry,
    /// The address of the HTTP API; `None` if another server answers with its routes.
    pub listen: Option<SocketAddr>,
    /// A file with the key that requests must have.
    pub api_key_file: Option<PathBuf>,
    /// True to answer every client of an address that other machines reach, without a key.
    pub open: bool,
    /// Public names of an open address, in lower case.
    pub hosts: Vec<String>,
    /// The file of the store.
    pub store: PathBuf,
    /// The time after which sums are removed.
    pub retention: Duration,
    /// The interval of the transactions.
    pub commit_every: Duration,
    /// The longest time between two reports of a camera that is known.
    pub longest_gap: Duration,
    /// Most cameras.
    pub max_cameras: usize,
    /// The time after which people on the floor are an alert; `None` for no alerts.
    pub floor_alert_after: Option<Duration>,
    /// Receivers of messages.
    pub webhooks: Vec<WebhookEntry>,
}

impl Default for CountEntry {
    fn default() -> Self {
        Self {
            server: ServerEntry::default(),
            listen: Some(SocketAddr::from(([127, 0, 0, 1], 8090))),
            api_key_file: None,
            open: false,
            hosts: Vec::new(),
            store: "counts.sqlite".into(),
            retention: Duration::from_hours(90 * 24),
            commit_every: Duration::from_secs(2),
            longest_gap: Duration::from_secs(10),
            max_cameras: 64,
            floor_alert_after: None,
            webhooks: Vec::new(),
        }
    }
}

/// The checked settings.
#[derive(Debug, Clone, PartialEq)]
pub struct CountOptions {
    /// The server.
    pub server: ServerOptions,
    /// The key that requests to the HTTP API must have.
    pub api_key: Option<Secret>,
    /// The other settings, as they are written.
    pub entry: CountEntry,
    /// Receivers of messages.
    pub(crate) webhooks: Vec<Webhook>,
    /// The reasons why other receivers get none.
    pub webhook_problems: Vec<String>,
}

impl CountEntry {
    /// Checks the entry and reads its files. Paths are relative to the current folder. Blocks.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn check(mut self) -> Result<CountOptions, ConfigError> {
        if self.webhooks.len() > MAX_WEBHOOKS {
            let remedy = "webhooks are too many: give at most 32";
            return Err(ConfigError::value("webhooks", &self.webhooks.len(), remedy));
        }
        let api_key = self.api_key_file.as_deref().map(read_key).transpose()?;
        let exposed = self.listen.filter(|listen| !listen.ip().is_loopback());
        if let Some(listen) = exposed.filter(|_| api_key.is_none() && !self.open) {
            let remedy = "is reached by other machines: set counts.api_key_file, or set counts.open \
                          to true to let every client read the counts";
            return Err(ConfigError::value("counts.listen", &listen, remedy));
        }
        let webhooks = std::mem::take(&mut self.webhooks).into_iter().enumerate();
        let (mut checked, mut webhook_problems) = (Vec::new(), Vec::new());
        for (index, entry) in webhooks {
            match entry.check(&format!("webhooks[{index}].")) {
                Ok(webhook) => checked.push(webhook),
                Err(problem) => webhook_problems.push(problem.to_string()),
            }
        }
        Ok(CountOptions {
            server: self.server.check()?,
            api_key,
            webhooks: checked,
            webhook_problems,
            entry: self,
        })
    }
}

/// Reads the key of the counts. Blocks.
///
/// # Errors
/// [`ConfigError`].
pub fn read_key(path: &Path) -> Result<Secret, ConfigError> {
    let key = read_secret("counts.api_key_file", path)?;
    if key.expose_secret().len() < LEAST_KEY_CHARS {
        let problem = "the key is too short: write at least 16 characters into the file";
        return Err(ConfigError::problem("counts.api_key_file", &problem));
    }
    Ok(key)
}
