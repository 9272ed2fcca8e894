//! HTTP requests to the server, with its key, its authorities and limits.

use std::time::Duration;

use http_body::Body as _;
use reqwest::{
    Body, Method, RequestBuilder, Response, Url,
    header::{AUTHORIZATION, CONTENT_LENGTH, HOST, HeaderMap, HeaderValue, RETRY_AFTER},
};
use secrecy::ExposeSecret;
use serde::Deserialize;

use crate::{
    InProcess, ServerOptions,
    http_transport::{ClientError, HttpClient, HttpError},
    text::{one_line, with_causes},
};

/// Longest `Retry-After` that is honored.
const MAX_RETRY_AFTER: Duration = Duration::from_mins(1);
/// Largest problem document that is read.
const MAX_PROBLEM_BYTES: usize = 64 << 10;

/// The requests to a server.
#[derive(Debug, Clone)]
pub struct ServerClient {
    client: HttpClient,
    url: Url,
    /// The header of the key.
    headers: HeaderMap,
    /// The server in this process.
    in_process: Option<InProcess>,
}

/// The parts of a problem document that are used.
#[derive(Debug, Default, Deserialize)]
struct Problem {
    #[serde(default)]
    detail: String,
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
        Ok(Self {
            client: HttpClient::new(options.authorities.as_deref())?,
            url: options.url.clone(),
            headers,
            in_process: options.in_process.clone(),
        })
    }

    /// Returns the URL of a route.
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

    /// Starts a request.
    pub fn request(&self, method: Method, url: Url) -> RequestBuilder {
        self.client.request(method, url)
    }

    /// Sends a request of this client.
    ///
    /// # Errors
    /// If the connection fails. A server in this process always answers.
    pub async fn send(&self, request: RequestBuilder) -> Result<Response, HttpError> {
        let request = request.headers(self.headers.clone());
        let Some(server) = &self.in_process else {
            return self.client.send(request).await;
        };
        let mut request: http::Request<Body> = request.build()?.try_into()?;
        let length = request.body().size_hint().exact();
        let headers = request.headers_mut();
        headers.insert(HOST, HeaderValue::from_static("localhost"));
        headers.extend(length.map(|length| (CONTENT_LENGTH, HeaderValue::from(length))));
        Ok(Response::from((server.answer)(request).await))
    }

    /// Returns the scheme, the host and the port of the server.
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
    pub fn failure(&self, error: &HttpError) -> String {
        format!(
            "the server {} cannot be reached: {}: start it, or correct upstream.url",
            self.address(),
            with_causes(error)
        )
    }
}

/// Returns the time of `Retry-After` in seconds, at most a minute.
pub fn retry_after(headers: &HeaderMap) -> Option<Duration> {
    let seconds = headers.get(RETRY_AFTER)?.to_str().ok()?.parse().ok()?;
    Some(Duration::from_secs(seconds).min(MAX_RETRY_AFTER))
}

/// Reads a body until it ends or has more than this many bytes.
///
/// # Errors
/// If the connection fails.
pub async fn read_body(mut response: Response, max_bytes: usize) -> Result<Vec<u8>, HttpError> {
    let mut body = Vec::new();
    while let Some(chunk) = response.chunk().await? {
        body.extend_from_slice(&chunk);
        if body.len() > max_bytes {
            break;
        }
    }
    Ok(body)
}
