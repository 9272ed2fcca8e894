//! Fetches the weights of a model and verifies their SHA-256: converted weights, or the file that
//! the authors of the network publish.

mod upstream;

use std::{
    fs::{self, File},
    io::{self, Read, Write},
    path::{Path, PathBuf},
    process,
    str::FromStr,
    time::Duration,
};

use lookdown_common::files::{self, Links};
use reqwest::{
    blocking::Client,
    redirect::{Action, Attempt, Policy},
};
use sha2::{Digest, Sha256};
use url::Url;

use super::ModelManifest;

pub use self::upstream::{Installed, Sha256Sum, fetch_upstream};

/// Largest file of weights, bytes: the limit of an ONNX file in one part.
const MAX_BYTES: u64 = 2 << 30;
/// Longest time for a connection, and without a byte of the answer.
const PATIENCE: Duration = Duration::from_secs(30);
/// Most redirections on the same host.
const MAX_REDIRECTIONS: usize = 5;
/// Bytes that are copied at a time.
const CHUNK: usize = 1 << 20;

/// A place with folders of converted models, each with the name of its model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ModelSource {
    /// A folder of this machine.
    Folder(PathBuf),
    /// An address, `http://` or `https://`.
    Address(Url),
}

impl FromStr for ModelSource {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if !text.contains("://") {
            return Ok(Self::Folder(text.into()));
        }
        let url: Url = text.parse().map_err(|error| format!("{error}"))?;
        let is_http = matches!(url.scheme(), "http" | "https");
        is_http
            .then_some(Self::Address(url))
            .ok_or_else(|| "give a folder, or an address with http:// or https://".to_owned())
    }
}

/// The reason why weights were not fetched.
#[derive(Debug, thiserror::Error)]
pub enum FetchError {
    /// The manifest has no sum to compare with.
    #[error(
        "{name}: its model.toml has no sha256, so a file cannot be verified: enter the SHA-256 of \
         the file that you trust"
    )]
    NoSum {
        /// The model.
        name: String,
    },
    /// The source does not have the file.
    #[error("{place} cannot be read ({problem}): check --from, or run `make models`")]
    Unreadable {
        /// The file or address.
        place: String,
        /// The cause.
        problem: String,
    },
    /// The file is another one.
    #[error(
        "{place} has the SHA-256 {found}, not {wanted} as in the model's model.toml: fetch the \
         model of this version of Lookdown, or run `make models`"
    )]
    WrongSum {
        /// The file or address.
        place: String,
        /// The sum of the file.
        found: String,
        /// The pinned sum.
        wanted: String,
    },
    /// No sum of the published file is known, and none was accepted.
    #[error(
        "{place} has the SHA-256 {found}, and the model's model.toml has no sum to compare with: \
         if you trust this file, add --accept-sha256 {found}"
    )]
    UnknownSum {
        /// The file or address.
        place: String,
        /// The sum of the file.
        found: String,
    },
    /// The file is not the accepted one.
    #[error("{place} has the SHA-256 {found}, not {accepted} as in --accept-sha256")]
    NotAccepted {
        /// The file or address.
        place: String,
        /// The sum of the file.
        found: String,
        /// The accepted sum.
        accepted: String,
    },
    /// The archive does not have the ONNX file.
    #[error(
        "{place} is not a usable archive: {problem}; correct upstream in the model's model.toml"
    )]
    Archive {
        /// The file or address.
        place: String,
        /// The cause.
        problem: String,
    },
    /// The published file is not a usable network.
    #[error("{place} cannot be installed: {problem}")]
    Unusable {
        /// The file or address.
        place: String,
        /// The mismatch.
        problem: String,
    },
    /// The file is too large.
    #[error("{place} has more than {MAX_BYTES} bytes: check --from")]
    TooLarge {
        /// The file or address.
        place: String,
    },
    /// The file cannot be written.
    #[error("{} cannot be written: {source}", path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
}

/// Fetches the weights of `model` and puts them into its folder in one step, after their sum was
/// compared. Returns the number of bytes. Blocks.
///
/// # Errors
/// [`FetchError`]; the folder is then unchanged.
pub fn fetch_weights(model: &ModelManifest, source: &ModelSource) -> Result<u64, FetchError> {
    let Some(wanted) = &model.sha256 else {
        let name = model.name.clone();
        return Err(FetchError::NoSum { name });
    };
    let file = model.onnx.file_name().unwrap_or_default();
    let (place, reader) = open(source, &model.name, Path::new(file))?;
    let unwritable = |source| FetchError::Unwritable {
        path: model.onnx.clone(),
        source,
    };
    let unfinished = model.onnx.with_extension(format!("{}", process::id()));
    let finished = copy(reader, &place, &unfinished, wanted);
    let finished = finished.and_then(|bytes| {
        fs::rename(&unfinished, &model.onnx).map_err(unwritable)?;
        Ok(bytes)
    });
    if finished.is_err() {
        // It may not exist.
        let _ = fs::remove_file(&unfinished);
    }
    finished
}

/// Copies a file whose sum is `wanted`. Returns the number of bytes.
fn copy(reader: impl Read, place: &str, to: &Path, wanted: &str) -> Result<u64, FetchError> {
    let unwritable = |source| FetchError::Unwritable {
        path: to.to_owned(),
        source,
    };
    let place = || place.to_owned();
    let mut file = File::create(to).map_err(unwritable)?;
    let mut reader = reader.take(MAX_BYTES + 1);
    let (mut sum, mut bytes, mut chunk) = (Sha256::new(), 0, vec![0; CHUNK]);
    loop {
        let read = reader
            .read(&mut chunk)
            .map_err(|error| FetchError::Unreadable {
                place: place(),
                problem: error.to_string(),
            })?;
        if read == 0 {
            break;
        }
        sum.update(&chunk[..read]);
        file.write_all(&chunk[..read]).map_err(unwritable)?;
        bytes += read as u64;
    }
    if bytes > MAX_BYTES {
        return Err(FetchError::TooLarge { place: place() });
    }
    let found = format!("{:x}", sum.finalize());
    if !found.eq_ignore_ascii_case(wanted) {
        return Err(FetchError::WrongSum {
            place: place(),
            found,
            wanted: wanted.to_owned(),
        });
    }
    file.sync_all().map_err(unwritable)?;
    Ok(bytes)
}

/// Follows a redirection to HTTPS only. The sum of the file is checked.
fn within_https(attempt: Attempt<'_>) -> Action {
    if attempt.previous().len() > MAX_REDIRECTIONS {
        attempt.error("there are too many redirections")
    } else if attempt.url().scheme() == "https" {
        attempt.follow()
    } else {
        attempt.error("it redirects to an address without https://")
    }
}

/// Follows a redirection on the same host only, and not from HTTPS to HTTP.
fn within_host(attempt: Attempt<'_>) -> Action {
    let first = attempt.previous().first();
    let is_same = first.is_some_and(|first| first.origin() == attempt.url().origin());
    if attempt.previous().len() > MAX_REDIRECTIONS {
        attempt.error("there are too many redirections")
    } else if is_same {
        attempt.follow()
    } else {
        attempt.error("it redirects to another host: give that address")
    }
}

/// Opens the file of a model at its source: in the folder of the model's name, or in the given
/// folder itself.
fn open(
    source: &ModelSource,
    name: &str,
    file: &Path,
) -> Result<(String, Box<dyn Read>), FetchError> {
    match source {
        ModelSource::Folder(folder) => {
            let inside = folder.join(name).join(file);
            let path = if inside.exists() || !folder.join(file).exists() {
                inside
            } else {
                folder.join(file)
            };
            let place = path.display().to_string();
            match files::open(&path, Links::Follow) {
                Ok(file) => Ok((place, Box::new(file))),
                Err(error) => Err(FetchError::Unreadable {
                    place,
                    problem: error.to_string(),
                }),
            }
        }
        ModelSource::Address(address) => {
            let base = address.as_str().trim_end_matches('/');
            let place = format!("{base}/{name}/{}", file.display());
            get(place, Policy::custom(within_host))
        }
    }
}

/// Sends a GET request.
fn get(place: String, redirect: Policy) -> Result<(String, Box<dyn Read>), FetchError> {
    // Fails when there is one already, which is as good.
    let _ = rustls::crypto::ring::default_provider().install_default();
    let client = Client::builder()
        // For the connection and for each read, not for the whole file.
        .timeout(PATIENCE)
        .redirect(redirect)
        .build();
    let response = client.and_then(|client| client.get(&place).send());
    match response.and_then(reqwest::blocking::Response::error_for_status) {
        Ok(response) => Ok((place, Box::new(response))),
        Err(error) => Err(FetchError::Unreadable {
            place,
            problem: error.without_url().to_string(),
        }),
    }
}
