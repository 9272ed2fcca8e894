//! The token that an inference server wants to see.

use std::str::FromStr;

use reqwest::header::HeaderValue;

/// A token, as it is sent with every request: a sensitive header, which is never shown.
#[derive(Debug, Clone, PartialEq)]
pub struct BearerToken(HeaderValue);

/// Text that is no token. It is not repeated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "give the token alone, as the inference server's operator gave it out: letters, digits and signs \
     without spaces"
)]
pub struct InvalidToken;

impl BearerToken {
    /// The header `Authorization` that shows it (RFC 6750, section 2.1).
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
