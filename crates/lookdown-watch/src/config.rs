//! The settings of `lookdown watch`: a TOML file of cameras, or one camera of the command line.

mod entry;
mod file;

pub use entry::{CameraEntry, parse_duration};
pub use file::{ServerEntry, load};

use std::path::PathBuf;

use reqwest::Url;
use secrecy::{ExposeSecret, SecretString};

use crate::Camera;

/// Most cameras of a process.
const MAX_CAMERAS: usize = 256;

/// The server that receives the frames.
#[derive(Debug, Clone)]
pub struct ServerOptions {
    /// Its base URL.
    pub url: Url,
    /// The API key.
    pub api_key: Option<SecretString>,
    /// The authorities to trust instead of those of the system, as PEM.
    pub authorities: Option<Vec<u8>>,
}

impl PartialEq for ServerOptions {
    fn eq(&self, other: &Self) -> bool {
        let key = |options: &Self| {
            let key = options.api_key.as_ref();
            key.map(|key| key.expose_secret().to_owned())
        };
        self.url == other.url && key(self) == key(other) && self.authorities == other.authorities
    }
}

/// The cameras to watch, and the server that receives their frames.
#[derive(Debug, Clone, PartialEq)]
pub struct WatchOptions {
    /// The server.
    pub server: ServerOptions,
    /// The cameras. Their names differ.
    pub cameras: Vec<Camera>,
}

/// A setting that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// A file that cannot be read.
    #[error("{field}: {path} cannot be read: {source}: give a readable file of at most 1 MiB")]
    Unreadable {
        /// The setting that names the file.
        field: String,
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// Not TOML, an unknown key, or a value of another type.
    #[error("{field}: {problem}")]
    Malformed {
        /// The place in the file.
        field: String,
        /// The problem and its remedy.
        problem: String,
    },
    /// A value that cannot be used.
    #[error("{field}: {value:?} {remedy}")]
    Value {
        /// The setting.
        field: String,
        /// Its value.
        value: String,
        /// The remedy, as the end of the sentence.
        remedy: String,
    },
    /// A missing or secret value.
    #[error("{field}: {problem}")]
    Problem {
        /// The setting.
        field: String,
        /// The problem and its remedy.
        problem: String,
    },
}

impl ConfigError {
    pub(crate) fn value(field: &str, value: &impl ToString, remedy: &str) -> Self {
        Self::Value {
            field: field.to_owned(),
            value: value.to_string(),
            remedy: remedy.to_owned(),
        }
    }

    pub(crate) fn problem(field: &str, problem: &impl ToString) -> Self {
        Self::Problem {
            field: field.to_owned(),
            problem: problem.to_string(),
        }
    }
}

impl WatchOptions {
    /// Checks that the names of the cameras differ, and that there are not too many.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn new(server: ServerOptions, cameras: Vec<Camera>) -> Result<Self, ConfigError> {
        if cameras.is_empty() {
            let problem = "there is no camera: add a [[cameras]] table with a url";
            return Err(ConfigError::problem("cameras", &problem));
        }
        if cameras.len() > MAX_CAMERAS {
            let remedy = "cameras are too many: start another process for those beyond 256";
            return Err(ConfigError::value("cameras", &cameras.len(), remedy));
        }
        let mut readers = 0;
        for (index, camera) in cameras.iter().enumerate() {
            if cameras[..index]
                .iter()
                .any(|other| other.name == camera.name)
            {
                let field = format!("cameras[{index}].name");
                let remedy = "is the name of an earlier camera: give each camera its own";
                return Err(ConfigError::value(&field, &camera.name, remedy));
            }
            readers += usize::from(camera.location == crate::Location::StandardInput);
            if readers > 1 {
                let field = format!("cameras[{index}].url");
                let remedy = "is read by an earlier camera: only one can read standard input";
                return Err(ConfigError::value(&field, &"-", remedy));
            }
        }
        Ok(Self { server, cameras })
    }
}
