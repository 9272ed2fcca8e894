//! The server and its API key, as written and as checked.

use std::path::PathBuf;

use reqwest::Url;
use serde::Deserialize;

use crate::{
    ConfigError, InProcess, Secret,
    config::{read_file, read_secret},
};

/// The server if none is given.
const DEFAULT_SERVER: &str = "http://127.0.0.1:8080";

/// The server of a companion.
#[derive(Debug, Clone, PartialEq)]
pub struct ServerOptions {
    /// Its base URL.
    pub url: Url,
    /// The API key.
    pub api_key: Option<Secret>,
    /// The authorities to trust instead of those of the system, as PEM.
    pub authorities: Option<Vec<u8>>,
    /// The server if it is in this process. The URL then only names it.
    pub in_process: Option<InProcess>,
}

/// The server as it is written in the file or on the command line.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ServerEntry {
    /// The base URL of the server.
    pub url: Option<String>,
    /// A file with the API key.
    pub api_key_file: Option<PathBuf>,
    /// A PEM file with the authorities to trust instead of those of the system.
    pub authorities: Option<PathBuf>,
}

impl ServerEntry {
    /// Checks the entry and reads its files.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn check(&self) -> Result<ServerOptions, ConfigError> {
        let text = self.url.as_deref().unwrap_or(DEFAULT_SERVER);
        let url = Url::parse(text).ok().filter(|url| {
            let is_http = matches!(url.scheme(), "http" | "https");
            is_http && url.username().is_empty() && url.password().is_none()
        });
        let Some(url) = url else {
            let remedy = "is not a URL of a server: write it like http://127.0.0.1:8080";
            // It may hold a password.
            let shown = text.rsplit('@').next().unwrap_or_default();
            return Err(ConfigError::value("upstream.url", &shown, remedy));
        };
        let key = self.api_key_file.as_deref();
        let key = key.map(|path| read_secret("upstream.api_key_file", path));
        let authorities = self.authorities.as_deref();
        let authorities = authorities.map(|path| read_file("upstream.authorities", path));
        Ok(ServerOptions {
            url,
            api_key: key.transpose()?,
            authorities: authorities.transpose()?,
            in_process: None,
        })
    }
}
