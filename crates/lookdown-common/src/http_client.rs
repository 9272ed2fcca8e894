//! HTTP requests to the server, with its key, its authorities and limits.

use std::{sync::OnceLock, time::Duration};

use http_body::Body as _;
use reqwest::{
    Body, Certificate, Client, RequestBuilder, Response, Url,
    header::{AUTHORIZATION, CONTENT_LENGTH, HOST, HeaderMap, HeaderValue, RETRY_AFTER},
    redirect,
};
use secrecy::ExposeSecret;
use serde::Deserialize;

use crate::{
    InProcess, ServerOptions,
    text::{one_line, with_causes},
};

/// Connect timeout.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);
/// Idle time after which a connection is closed: less than the keep-alive of common servers.
const IDLE_TIMEOUT: Duration = Duration::from_secs(20);
/// Longest `Retry-After` that is honored.
const MAX_RETRY_AFTER: Duration = Duration::from_mins(1);
/// Largest problem document that is read.
const MAX_PROBLEM_BYTES: usize = 64 << 10;

/// A reason why there is no HTTP client.
#[derive(Debug, thiserror::Error)]
#[error(
    "upstream.authorities: {0}: give a PEM file with the authorities of the server's certificate"
)]
pub struct ClientError(String);

/// The requests to a server.
#[derive(Debug, Clone)]
pub struct ServerClient {
    client: Client,
    url: Url,
    /// The server in this process, with the header of its key.
    in_process: Option<(InProcess, HeaderMap)>,
}

/// The parts of a problem document that are used.
#[derive(Debug, Default, Deserialize)]
struct Problem {
    #[serde(default)]
    detail: String,
}

/// Starts an HTTP client with a connect timeout, without redirections and proxies. On a system
/// without certificates of authorities it trusts none: plain HTTP works, and HTTPS needs
/// authorities of its own.
pub fn client_builder() -> reqwest::ClientBuilder {
    static SYSTEM_HAS_AUTHORITIES: OnceLock<bool> = OnceLock::new();
    // Fails when a provider is already installed, which has the same effect.
    let _ = rustls::crypto::ring::default_provider().install_default();
    if *SYSTEM_HAS_AUTHORITIES.get_or_init(|| bare_builder().build().is_ok()) {
        bare_builder()
    } else {
        bare_builder().tls_certs_only([])
    }
}

fn bare_builder() -> reqwest::ClientBuilder {
    Client::builder()
        .connect_timeout(CONNECT_TIMEOUT)
        .pool_idle_timeout(IDLE_TIMEOUT)
        .redirect(redirect::Policy::none())
        .no_proxy()
}

impl From<reqwest::Error> for ClientError {
    fn from(error: reqwest::Error) -> Self {
        Self(with_causes(&error))
    }
}

impl ServerClient {
    /// Creates the client. Sends nothing.
    ///
    /// # Errors
    /// [`ClientError`] if the authorities or the key cannot be used.
    pub fn new(options: &ServerOptions) -> Result<Self, ClientError> {
        let mut headers = HeaderMap::new();
        if let Some(key) = &options.api_key {
            let key = HeaderValue::try_from(format!("Bearer {}", key.expose_secret()));
            let mut key = key.map_err(|_| {
                ClientError("the API key has characters that no header may have".to_owned())
            })?;
            key.set_sensitive(true);
            headers.insert(AUTHORIZATION, key);
        }
        let mut builder = client_builder().default_headers(headers.clone());
        if let Some(pem) = &options.authorities {
            builder = builder.tls_certs_only(Certificate::from_pem_bundle(pem)?);
        }
        Ok(Self {
            client: builder.build()?,
            url: options.url.clone(),
            in_process: options.in_process.clone().map(|server| (server, headers)),
        })
    }

    /// Returns the URL of a route.
    #[must_use]
    pub fn route<'a>(&self, segments: impl IntoIterator<Item = &'a str>) -> Url {
        let mut url = self.url.clone();
        // HTTP URLs always have a path.
        if let Ok(mut path) = url.path_segments_mut() {
            path.pop_if_empty().extend(segments);
        }
        url
    }

    /// Starts a GET request.
    pub fn get(&self, url: Url) -> RequestBuilder {
        self.client.get(url)
    }

    /// Starts a PUT request.
    pub fn put(&self, url: Url) -> RequestBuilder {
        self.client.put(url)
    }

    /// Starts a POST request.
    pub fn post(&self, url: Url) -> RequestBuilder {
        self.client.post(url)
    }

    /// Sends a request of this client.
    ///
    /// # Errors
    /// If the connection fails. A server in this process always answers.
    pub async fn send(&self, request: RequestBuilder) -> reqwest::Result<Response> {
        let Some((server, own_headers)) = &self.in_process else {
            return request.send().await;
        };
        let mut request: http::Request<Body> = request.build()?.try_into()?;
        let length = request.body().size_hint().exact();
        let headers = request.headers_mut();
        headers.extend(own_headers.clone());
        headers.insert(HOST, HeaderValue::from_static("localhost"));
        headers.extend(length.map(|length| (CONTENT_LENGTH, HeaderValue::from(length))));
        Ok(Response::from(server.answer(request).await))
    }

    /// Returns the scheme, the host and the port of the server.
    #[must_use]
    pub fn address(&self) -> String {
        self.url.origin().ascii_serialization()
    }

    /// Describes a response that is not a success, with the detail of its problem document.
    pub async fn refusal(&self, response: Response) -> String {
        let status = response.status();
        let body = read_body(response, MAX_PROBLEM_BYTES).await;
        let problem: Problem =
            serde_json::from_slice(&body.unwrap_or_default()).unwrap_or_default();
        let address = self.address();
        match problem.detail.as_str() {
            "" => format!("{address} answered {status}: check upstream.url"),
            detail => one_line(&format!("{address} answered {status}: {detail}")),
        }
    }

    /// Describes a request without a response.
    #[must_use]
    pub fn failure(&self, error: reqwest::Error) -> String {
        format!(
            "the server {} cannot be reached: {}: start it, or correct upstream.url",
            self.address(),
            with_causes(&error.without_url())
        )
    }
}

/// Returns the time of `Retry-After` in seconds, at most a minute.
#[must_use]
pub fn retry_after(headers: &HeaderMap) -> Option<Duration> {
    let seconds = headers.get(RETRY_AFTER)?.to_str().ok()?.parse().ok()?;
    Some(Duration::from_secs(seconds).min(MAX_RETRY_AFTER))
}

/// Reads a body until it ends or has more than this many bytes.
///
/// # Errors
/// If the connection fails.
pub async fn read_body(mut response: Response, max_bytes: usize) -> reqwest::Result<Vec<u8>> {
    let mut body = Vec::new();
    while let Some(chunk) = response.chunk().await? {
        body.extend_from_slice(&chunk);
        if body.len() > max_bytes {
            break;
        }
    }
    Ok(body)
}
