//! HTTP to the server: connections that are kept, bounds on the time and the length of every answer.

use std::{error::Error, io::Read, time::Duration};

use bytes::Bytes;
use reqwest::{
    blocking::{Client, RequestBuilder, Response},
    header::{AUTHORIZATION, CONTENT_TYPE, RETRY_AFTER},
    redirect,
};
use url::Url;

use super::RemoteOptions;
use crate::open_inference::HEAD_LENGTH;

/// Longest that a connection may take to be made.
const CONNECT_PATIENCE: Duration = Duration::from_secs(2);
/// Longest that a connection stays open while nothing is sent: less than servers and proxies commonly keep one.
const IDLE: Duration = Duration::from_secs(20);
/// Most bytes of an answer: those of the raw outputs of a large network for a large batch.
const MAX_ANSWER_BYTES: u64 = 64 << 20;

/// Connections to a server.
pub(super) struct Connection {
    client: Client,
    address: Url,
    patience: Duration,
}

/// What a server answered.
#[derive(Debug)]
pub(super) struct Reply {
    pub(super) status: u16,
    /// When it wants to be asked again.
    pub(super) retry_after: Option<Duration>,
    /// The length of the JSON, where bytes follow it.
    pub(super) head_length: Option<usize>,
    pub(super) body: Vec<u8>,
}

impl Connection {
    /// Sends nothing yet.
    ///
    /// # Errors
    /// When the system's certificates cannot be used.
    pub(super) fn new(options: &RemoteOptions) -> reqwest::Result<Self> {
        // Fails when there is one already, which is as good.
        let _ = rustls::crypto::ring::default_provider().install_default();
        let token = options.token.as_ref();
        let headers = token.map(|token| (AUTHORIZATION, token.authorization()));
        let client = Client::builder()
            .default_headers(headers.into_iter().collect())
            .connect_timeout(CONNECT_PATIENCE.min(options.patience))
            .pool_idle_timeout(IDLE)
            .redirect(redirect::Policy::none())
            .no_proxy()
            .build()?;
        Ok(Self {
            client,
            address: options.url.clone(),
            patience: options.patience,
        })
    }

    pub(super) fn address(&self) -> &Url {
        &self.address
    }

    /// Asks for what is at a path, whose parts are given.
    pub(super) fn get(&self, path: &[&str], patience: Duration) -> Result<Reply, String> {
        reply(|| self.client.get(self.at(path)).timeout(patience))
    }

    /// Sends JSON, or, with the length of the JSON, JSON and bytes behind it.
    pub(super) fn post(
        &self,
        path: &[&str],
        body: &Bytes,
        head_length: Option<usize>,
    ) -> Result<Reply, String> {
        reply(|| {
            let request = self.client.post(self.at(path)).timeout(self.patience);
            let request = match head_length {
                Some(length) => request
                    .header(HEAD_LENGTH, length)
                    .header(CONTENT_TYPE, "application/octet-stream"),
                None => request.header(CONTENT_TYPE, "application/json"),
            };
            request.body(body.clone())
        })
    }

    /// The address of a path below the server's own.
    fn at(&self, path: &[&str]) -> Url {
        let mut address = self.address.clone();
        // Only addresses that can have paths come this far.
        if let Ok(mut parts) = address.path_segments_mut() {
            parts.pop_if_empty().extend(path);
        }
        address
    }
}

/// Sends a request; once more when no connection could be made, or one that was kept was closed
/// before an answer came, as servers do that are restarted. Inference changes nothing there, so it may
/// be asked for twice; whoever takes too long is not given more work.
fn reply(request: impl Fn() -> RequestBuilder) -> Result<Reply, String> {
    let sent = match request().send() {
        Err(error) if (error.is_connect() || error.is_request()) && !error.is_timeout() => {
            request().send()
        }
        sent => sent,
    };
    sent.map_err(with_causes).and_then(read)
}

fn read(response: Response) -> Result<Reply, String> {
    let number = |name: &str| {
        let value = response.headers().get(name)?;
        value.to_str().ok()?.parse::<u64>().ok()
    };
    let head_length = number(HEAD_LENGTH).and_then(|length| usize::try_from(length).ok());
    let retry_after = number(RETRY_AFTER.as_str()).map(Duration::from_secs);
    let status = response.status().as_u16();
    let mut body = Vec::new();
    let mut bounded = response.take(MAX_ANSWER_BYTES + 1);
    let length = bounded.read_to_end(&mut body);
    let length = length.map_err(|error| format!("its answer broke off: {error}"))?;
    if length as u64 > MAX_ANSWER_BYTES {
        return Err(format!(
            "its answer is longer than {MAX_ANSWER_BYTES} bytes"
        ));
    }
    Ok(Reply {
        status,
        retry_after,
        head_length,
        body,
    })
}

/// The error and why it came to it, in one line.
fn with_causes(error: reqwest::Error) -> String {
    let error = error.without_url();
    let mut told = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        told = format!("{told}: {error}");
        cause = error.source();
    }
    told
}
