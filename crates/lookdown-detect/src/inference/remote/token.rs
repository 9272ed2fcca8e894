//! The bearer token for an inference server.

use std::str::FromStr;

use reqwest::header::HeaderValue;

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
