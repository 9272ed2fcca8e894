//! The options of an inference server, and the HTTP connection to it: keep-alive, and limits on the
//! time and size of every response.

use std::{io::Read, str::FromStr, time::Duration};

use bytes::Bytes;
use lookdown_common::text::{one_line, with_causes};
use reqwest::{
    blocking::{Client, RequestBuilder, Response},
    header::{AUTHORIZATION, CONTENT_TYPE, HeaderValue, RETRY_AFTER},
    redirect,
};
use url::Url;

use crate::open_inference::{HEAD_LENGTH, message::Message};

/// Connect timeout.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(2);
/// Longest idle time of a connection: less than the keep-alive of common servers and proxies.
const IDLE_TIMEOUT: Duration = Duration::from_secs(20);
/// Largest response to an inference request, in bytes: the raw outputs of a large network for a
/// large batch.
const MAX_ANSWER_BYTES: u64 = 64 << 20;
/// Largest metadata, in bytes. Parsed, they take several times the memory.
const MAX_METADATA_BYTES: u64 = 1 << 20;
/// Longest pause that is passed on to clients.
const MAX_RETRY_AFTER: Duration = Duration::from_mins(1);

/// Connections to a server.
pub(super) struct Connection {
    client: Client,
    pub(super) address: Url,
    timeout: Duration,
}

/// Response of a server.
#[derive(Debug)]
pub(super) struct Reply {
    pub(super) status: u16,
    /// Value of `Retry-After`.
    pub(super) retry_after: Option<Duration>,
    /// Length of the JSON, if bytes follow it.
    pub(super) head_length: Option<usize>,
    pub(super) body: Vec<u8>,
}

impl Reply {
    /// Returns the body as a message of the protocol.
    pub(super) fn into_message(self) -> Message {
        Message {
            body: self.body.into(),
            head_length: self.head_length,
        }
    }
}

impl Connection {
    /// Creates the client. Sends nothing.
    ///
    /// # Errors
    /// Returns an error if the system's certificates cannot be used.
    pub(super) fn new(options: &RemoteOptions) -> reqwest::Result<Self> {
        // Fails when a provider is already installed, which has the same effect.
        let _ = rustls::crypto::ring::default_provider().install_default();
        let token = options.token.as_ref();
        let headers = token.map(|token| (AUTHORIZATION, token.authorization()));
        let client = Client::builder()
            .default_headers(headers.into_iter().collect())
            .connect_timeout(CONNECT_TIMEOUT.min(options.timeout))
            .pool_idle_timeout(IDLE_TIMEOUT)
            .redirect(redirect::Policy::none())
            .no_proxy()
            .build()?;
        Ok(Self {
            client,
            address: options.url.clone(),
            timeout: options.timeout,
        })
    }

    /// Sends a GET request to the path with the given segments.
    pub(super) fn get(&self, path: &[&str], timeout: Duration) -> Result<Reply, String> {
        let request = || self.client.get(self.at(path)).timeout(timeout);
        reply(request, MAX_METADATA_BYTES)
    }

    /// Sends a POST request with JSON, or, with the length of the JSON, JSON followed by bytes.
    pub(super) fn post(
        &self,
        path: &[&str],
        body: &Bytes,
        head_length: Option<usize>,
    ) -> Result<Reply, String> {
        let request = || {
            let request = self.client.post(self.at(path)).timeout(self.timeout);
            let request = match head_length {
                Some(length) => request
                    .header(HEAD_LENGTH, length)
                    .header(CONTENT_TYPE, "application/octet-stream"),
                None => request.header(CONTENT_TYPE, "application/json"),
            };
            request.body(body.clone())
        };
        reply(request, MAX_ANSWER_BYTES)
    }

    /// The URL of a path below the server's base URL.
    fn at(&self, path: &[&str]) -> Url {
        let mut address = self.address.clone();
        // Only URLs that can have a path are configured.
        if let Ok(mut parts) = address.path_segments_mut() {
            parts.pop_if_empty().extend(path);
        }
        address
    }
}

/// Sends a request. Retries once when the connection fails or an idle connection was closed before
/// the response, for example by a restarted server. Inference has no side effects, so a repeated
/// request is safe. A timeout is not retried, to avoid more load on a slow server.
fn reply(request: impl Fn() -> RequestBuilder, max_bytes: u64) -> Result<Reply, String> {
    let sent = match request().send() {
        Err(error) if (error.is_connect() || error.is_request()) && !error.is_timeout() => {
            request().send()
        }
        sent => sent,
    };
    sent.map_err(|error| with_causes(&error.without_url()))
        .and_then(|response| read(response, max_bytes))
}

fn read(response: Response, max_bytes: u64) -> Result<Reply, String> {
    let number = |name: &str| {
        let value = response.headers().get(name)?;
        value.to_str().ok()?.parse::<u64>().ok()
    };
    let head_length = number(HEAD_LENGTH).and_then(|length| usize::try_from(length).ok());
    let retry_after = number(RETRY_AFTER.as_str());
    let retry_after = retry_after.map(|seconds| Duration::from_secs(seconds).min(MAX_RETRY_AFTER));
    let status = response.status().as_u16();
    let mut body = Vec::new();
    let mut bounded = response.take(max_bytes + 1);
    let length = bounded.read_to_end(&mut body);
    let length =
        length.map_err(|error| format!("its response is incomplete: {}", one_line(&error)))?;
    if length as u64 > max_bytes {
        return Err(format!("its response is longer than {max_bytes} bytes"));
    }
    Ok(Reply {
        status,
        retry_after,
        head_length,
        body,
    })
}

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
