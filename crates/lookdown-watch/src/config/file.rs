//! The file `cameras.toml`, and the small files that it names.

use std::{
    fs::File,
    io::{self, Read},
    path::{Path, PathBuf},
};

use reqwest::Url;
use secrecy::SecretString;
use serde::Deserialize;

use super::{CameraEntry, ConfigError, ServerOptions, WatchOptions};

/// Most bytes of a file.
const MAX_BYTES: u64 = 1 << 20;
/// The server if none is given.
const DEFAULT_SERVER: &str = "http://127.0.0.1:8080";

/// The file as it is written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct WatchFile {
    #[serde(default)]
    server: ServerEntry,
    #[serde(default)]
    defaults: CameraEntry,
    #[serde(default)]
    cameras: Vec<CameraEntry>,
}

/// The server as it is written in the file or on the command line.
#[derive(Debug, Clone, Default, Deserialize)]
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
    /// Fills absent values with those of another entry.
    #[must_use]
    pub fn or(self, other: &Self) -> Self {
        Self {
            url: self.url.or_else(|| other.url.clone()),
            api_key_file: self.api_key_file.or_else(|| other.api_key_file.clone()),
            authorities: self.authorities.or_else(|| other.authorities.clone()),
        }
    }

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
            let remedy = "is no URL of a server: write it like http://127.0.0.1:8080";
            // It may hold a password.
            let shown = text.rsplit('@').next().unwrap_or_default();
            return Err(ConfigError::value("server.url", &shown, remedy));
        };
        let key = self.api_key_file.as_deref();
        let key = key.map(|path| read_secret("server.api_key_file", path));
        let authorities = self.authorities.as_deref();
        let authorities = authorities.map(|path| read("server.authorities", path));
        Ok(ServerOptions {
            url,
            api_key: key.transpose()?,
            authorities: authorities.transpose()?,
        })
    }
}

/// Reads and checks the file and the files that it names. `server` has precedence over the server
/// of the file. Paths are relative to the current folder. Blocks.
///
/// # Errors
/// [`ConfigError`].
pub fn load(path: &Path, server: &ServerEntry) -> Result<WatchOptions, ConfigError> {
    let text = read("cameras", path)?;
    let text = String::from_utf8_lossy(&text);
    let file = parse(&text)?;
    let server = server.clone().or(&file.server).check()?;
    let cameras = file.cameras.into_iter().enumerate();
    let cameras = cameras.map(|(index, camera)| {
        camera
            .or(&file.defaults)
            .check(&format!("cameras[{index}]."))
    });
    WatchOptions::new(server, cameras.collect::<Result<_, _>>()?)
}

fn parse(text: &str) -> Result<WatchFile, ConfigError> {
    let malformed = |field: String, error: &toml::de::Error| {
        let line = error.span().map_or(1, |span| {
            let before = text.get(..span.start).unwrap_or_default();
            before.matches('\n').count() + 1
        });
        let message = error.message().trim();
        ConfigError::Malformed {
            field,
            problem: format!(
                "{message} (line {line}): correct the file as docs/watch.md describes"
            ),
        }
    };
    let deserializer =
        toml::Deserializer::parse(text).map_err(|error| malformed("cameras".to_owned(), &error))?;
    serde_path_to_error::deserialize(deserializer)
        .map_err(|error| malformed(error.path().to_string(), error.inner()))
}

/// Reads a file of at most 1 MiB.
fn read(field: &str, path: &Path) -> Result<Vec<u8>, ConfigError> {
    let limited = || {
        let mut content = Vec::new();
        let length = File::open(path)?
            .take(MAX_BYTES + 1)
            .read_to_end(&mut content)?;
        if length as u64 > MAX_BYTES {
            return Err(io::Error::other("it has more than 1 MiB"));
        }
        Ok(content)
    };
    limited().map_err(|source| ConfigError::Unreadable {
        field: field.to_owned(),
        path: path.to_owned(),
        source,
    })
}

/// Reads a secret: the first line of a file.
pub(super) fn read_secret(field: &str, path: &Path) -> Result<SecretString, ConfigError> {
    let content = read(field, path)?;
    let text = String::from_utf8_lossy(&content);
    let line = text.lines().next().unwrap_or_default().trim_end();
    if line.is_empty() {
        let remedy = "is an empty file: write the secret on its first line";
        return Err(ConfigError::value(field, &path.display(), remedy));
    }
    Ok(line.into())
}
