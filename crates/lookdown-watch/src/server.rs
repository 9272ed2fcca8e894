//! Requests to the Lookdown server.

use std::time::Duration;

use reqwest::{
    Certificate, Client, Response, StatusCode, Url,
    header::{AUTHORIZATION, CONTENT_TYPE, HeaderMap, HeaderValue, RETRY_AFTER},
    redirect,
};
use secrecy::ExposeSecret;
use serde::Deserialize;

use crate::{
    Camera, Frame, ServerOptions,
    text::{one_line, with_causes},
};

/// Connect timeout of servers and cameras.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);
/// Idle time after which a connection is closed: less than the keep-alive of common servers.
const IDLE_TIMEOUT: Duration = Duration::from_secs(20);
/// Longest time for a report.
const REPORT_TIMEOUT: Duration = Duration::from_secs(35);
/// Longest `Retry-After` that is honoured.
const MAX_RETRY_AFTER: Duration = Duration::from_mins(1);
/// Largest problem document that is read.
const MAX_PROBLEM_BYTES: usize = 64 << 10;
/// Largest report that is read.
const MAX_REPORT_BYTES: usize = 32 << 20;

/// A reason why there is no HTTP client.
#[derive(Debug, thiserror::Error)]
#[error(
    "server.authorities: {0}: give a PEM file with the authorities of the server's certificate"
)]
pub struct ClientError(String);

/// A connection to the server.
pub(crate) struct Server {
    client: Client,
    detect: Url,
}

/// The answer to a frame.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Answer {
    /// The server returned a report.
    Report,
    /// The server is busy. Holds the time of `Retry-After`.
    Busy(String, Option<Duration>),
    /// The server refuses the frame or its parameters.
    Refused(String),
    /// The server cannot be reached, or failed.
    Failed(String),
}

/// The parts of a problem document that are used.
#[derive(Debug, Default, Deserialize)]
struct Problem {
    #[serde(default)]
    detail: String,
}

/// Creates an HTTP client for cameras.
///
/// # Errors
/// [`ClientError`] if the system's certificates cannot be used.
pub(crate) fn camera_client() -> Result<Client, ClientError> {
    builder().build().map_err(problem)
}

fn builder() -> reqwest::ClientBuilder {
    // Fails when a provider is already installed, which has the same effect.
    let _ = rustls::crypto::ring::default_provider().install_default();
    Client::builder()
        .connect_timeout(CONNECT_TIMEOUT)
        .pool_idle_timeout(IDLE_TIMEOUT)
        .redirect(redirect::Policy::none())
        .no_proxy()
}

#[expect(clippy::needless_pass_by_value, reason = "it is used as a function")]
fn problem(error: reqwest::Error) -> ClientError {
    ClientError(with_causes(&error))
}

impl Server {
    /// Creates the client. Sends nothing.
    ///
    /// # Errors
    /// [`ClientError`] if the authorities cannot be used.
    pub(crate) fn new(options: &ServerOptions) -> Result<Self, ClientError> {
        let mut headers = HeaderMap::new();
        if let Some(key) = &options.api_key {
            let key = HeaderValue::try_from(format!("Bearer {}", key.expose_secret()));
            let mut key = key.map_err(|_| {
                ClientError("the API key has characters that no header may have".to_owned())
            })?;
            key.set_sensitive(true);
            headers.insert(AUTHORIZATION, key);
        }
        let mut builder = builder().default_headers(headers).timeout(REPORT_TIMEOUT);
        if let Some(pem) = &options.authorities {
            let authorities = Certificate::from_pem_bundle(pem).map_err(problem)?;
            builder = builder.tls_certs_only(authorities);
        }
        let mut detect = options.url.clone();
        // HTTP URLs always have a path.
        if let Ok(mut path) = detect.path_segments_mut() {
            path.pop_if_empty().push("detect");
        }
        Ok(Self {
            client: builder.build().map_err(problem)?,
            detect,
        })
    }

    /// Sends a frame, and waits for its report.
    pub(crate) async fn detect(&self, camera: &Camera, frame: &Frame) -> Answer {
        let mut url = self.detect.clone();
        url.query_pairs_mut()
            .extend_pairs(&camera.parameters)
            .append_pair("captured_at", &frame.captured_at.to_string());
        let request = self.client.post(url);
        let request = request.header(CONTENT_TYPE, frame.format.media_type());
        match request.body(frame.image.clone()).send().await {
            Ok(response) => self.answer(response).await,
            Err(error) => self.failure(&error.without_url()),
        }
    }

    async fn answer(&self, response: Response) -> Answer {
        let status = response.status();
        if status.is_success() {
            // The rest is read so that the connection can be used again.
            return match read(response, MAX_REPORT_BYTES).await {
                Ok(_) => Answer::Report,
                Err(error) => self.failure(&error.without_url()),
            };
        }
        let retry_after = retry_after(response.headers());
        let body = read(response, MAX_PROBLEM_BYTES).await.unwrap_or_default();
        let problem: Problem = serde_json::from_slice(&body).unwrap_or_default();
        let address = self.address();
        let message = match problem.detail.as_str() {
            "" => format!("{address} answered {status}: check server.url"),
            detail => one_line(&format!("{address} answered {status}: {detail}")),
        };
        match status {
            StatusCode::TOO_MANY_REQUESTS | StatusCode::SERVICE_UNAVAILABLE => {
                Answer::Busy(message, retry_after)
            }
            status if status.is_client_error() && status != StatusCode::REQUEST_TIMEOUT => {
                Answer::Refused(message)
            }
            _ => Answer::Failed(message),
        }
    }

    fn failure(&self, error: &reqwest::Error) -> Answer {
        let address = self.address();
        Answer::Failed(format!(
            "the server {address} cannot be reached: {}: start it, or correct server.url",
            with_causes(error)
        ))
    }

    /// The scheme, the host and the port of the server.
    fn address(&self) -> String {
        self.detect.origin().ascii_serialization()
    }
}

/// Returns the time of `Retry-After` in seconds, bounded.
fn retry_after(headers: &HeaderMap) -> Option<Duration> {
    let seconds = headers.get(RETRY_AFTER)?.to_str().ok()?.parse().ok()?;
    Some(Duration::from_secs(seconds).min(MAX_RETRY_AFTER))
}

/// Reads at most this many bytes of a body.
async fn read(mut response: Response, max_bytes: usize) -> reqwest::Result<Vec<u8>> {
    let mut body = Vec::new();
    while let Some(chunk) = response.chunk().await? {
        body.extend_from_slice(&chunk);
        if body.len() > max_bytes {
            break;
        }
    }
    Ok(body)
}
