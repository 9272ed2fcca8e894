//! The place of a file: a folder or an address.

use std::{
    io::Read,
    path::{Path, PathBuf},
    str::FromStr,
    time::Duration,
};

use lookdown_common::{
    files::{self, Links},
    text::with_causes,
};
use reqwest::{
    blocking::Client,
    redirect::{Action, Attempt, Policy},
};
use url::Url;

use super::error::FetchError;

/// Longest time for a connection, and without a byte of the answer.
const TIMEOUT: Duration = Duration::from_secs(30);
/// Most redirections.
const MAX_REDIRECTIONS: usize = 5;

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

/// Follows a redirection to HTTPS only. The sum of the file is checked.
pub(super) fn within_https(attempt: Attempt<'_>) -> Action {
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
pub(super) fn open(
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
pub(super) fn get(place: String, redirect: Policy) -> Result<(String, Box<dyn Read>), FetchError> {
    // Fails when there is one already, which is as good.
    let _ = rustls::crypto::ring::default_provider().install_default();
    let client = Client::builder()
        // For the connection and for each read, not for the whole file.
        .timeout(TIMEOUT)
        .redirect(redirect)
        .build();
    let response = client.and_then(|client| client.get(&place).send());
    match response.and_then(reqwest::blocking::Response::error_for_status) {
        Ok(response) => Ok((place, Box::new(response))),
        Err(error) => Err(FetchError::Unreadable {
            place,
            problem: with_causes(&error.without_url()),
        }),
    }
}
