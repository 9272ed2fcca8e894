//! The options of an inference server.

use std::{str::FromStr, time::Duration};

use reqwest::header::HeaderValue;
use url::Url;

/// Settings of the inference server.
#[derive(Debug, Clone, PartialEq)]
pub struct RemoteOptions {
    /// The server's address, without `/v2`.
    pub url: Url,
    /// Token sent with every request, if any.
    pub token: Option<BearerToken>,
    /// Name on the server of the model whose readiness represents the server's.
    pub model: String,
    /// Manifest name of the model that is called `model` on the server. Other names are the same in
    /// both.
    pub called: String,
    /// Timeout of one inference request.
    pub timeout: Duration,
}

/// A token sent with every request. The header is marked as sensitive and never logged.
#[derive(Debug, Clone, PartialEq)]
pub struct BearerToken(HeaderValue);

/// Invalid token text. It is not repeated in the error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "use only the token that the inference server's operator issued: letters, digits and signs \
     without spaces"
)]
pub struct InvalidToken;

impl BearerToken {
    /// The header `Authorization` with the token (RFC 6750, section 2.1).
    pub(super) fn authorization(&self) -> HeaderValue {
        self.0.clone()
    }
}

impl FromStr for BearerToken {
    type Err = InvalidToken;

    fn from_str(text: &str) -> Result<Self, InvalidToken> {
        let is_token = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_graphic());
        let header = HeaderValue::try_from(format!("Bearer {text}"));
        let mut header = header.ok().filter(|_| is_token).ok_or(InvalidToken)?;
        header.set_sensitive(true);
        Ok(Self(header))
    }
}
