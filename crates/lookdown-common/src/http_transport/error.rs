//! The reasons why there is no client, or no response.

use std::time::Duration;

use hyper_util::client::legacy;

/// Most provisional responses before a response.
pub(super) const MAX_PROVISIONAL: usize = 16;

/// A reason why there is no HTTP client.
#[derive(Debug, thiserror::Error)]
#[error(
    "upstream.authorities: {0}: give a PEM file with the authorities of the server's certificate"
)]
pub struct ClientError(pub(crate) String);

/// The reason why a request has no response, or its response no end.
#[derive(Debug, thiserror::Error)]
pub enum HttpError {
    /// A request that cannot be written, or a body that ends early.
    #[error(transparent)]
    Message(reqwest::Error),
    /// No connection, or one that ended.
    #[error(transparent)]
    Connection(#[from] legacy::Error),
    /// No response in time.
    #[error("there is no whole response within {0:?}")]
    Timeout(Duration),
    /// Provisional responses without end.
    #[error("more than {MAX_PROVISIONAL} provisional responses (1xx) arrived before the response")]
    Provisional,
}

impl From<reqwest::Error> for HttpError {
    fn from(error: reqwest::Error) -> Self {
        // A URL may be a secret.
        Self::Message(error.without_url())
    }
}
