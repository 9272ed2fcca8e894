//! The HTTP client of the trace collector. Requests have a timeout, and only the first failure of
//! an outage is logged.

use std::{
    sync::atomic::{AtomicBool, Ordering},
    time::Duration,
};

use async_trait::async_trait;
use lookdown_common::text::with_causes;
use opentelemetry_http::{Bytes, HttpClient, HttpError, Request, Response};
use reqwest::{Client, redirect};
use tokio::runtime::Handle;

/// Longest time for one delivery.
const DELIVERY_TIMEOUT: Duration = Duration::from_secs(5);
/// Most bytes of a response that are read.
const MAX_ANSWER_BYTES: usize = 64 * 1024;

/// Delivers the spans that the exporter has serialized.
#[derive(Debug)]
pub(super) struct Collector {
    client: Client,
    /// The exporter's thread has no runtime.
    runtime: Handle,
    is_down: AtomicBool,
}

impl Collector {
    /// Creates a client that has sent nothing yet. Needs a tokio runtime.
    ///
    /// # Errors
    /// If the certificates of the system cannot be used.
    pub(super) fn new() -> reqwest::Result<Self> {
        // Fails if a provider is already installed, which is equally good.
        let _ = rustls::crypto::ring::default_provider().install_default();
        let client = Client::builder()
            .timeout(DELIVERY_TIMEOUT)
            .redirect(redirect::Policy::none())
            .build()?;
        Ok(Self {
            client,
            runtime: Handle::current(),
            is_down: AtomicBool::new(false),
        })
    }

    /// Logs the beginning and the end of an outage, once each.
    fn log_outage(&self, problem: Option<String>) {
        let was_down = self.is_down.swap(problem.is_some(), Ordering::Relaxed);
        match problem {
            Some(problem) if !was_down => tracing::warn!(
                "traces cannot be sent, and are lost until they can (telemetry.otlp_endpoint): \
                 {problem}"
            ),
            None if was_down => tracing::info!("traces can be sent again"),
            _ => {}
        }
    }
}

#[async_trait]
impl HttpClient for Collector {
    async fn send_bytes(&self, request: Request<Bytes>) -> Result<Response<Bytes>, HttpError> {
        let client = self.client.clone();
        let delivery = self.runtime.spawn(deliver(client, request));
        // Dropping the runtime cancels the task.
        let delivered = delivery.await.unwrap_or_else(|error| Err(error.into()));
        self.log_outage(match &delivered {
            Ok(answer) if answer.status().is_success() => None,
            Ok(answer) => Some(format!("the collector answered {}", answer.status())),
            Err(error) => Some(with_causes(error.as_ref())),
        });
        delivered
    }
}

async fn deliver(client: Client, request: Request<Bytes>) -> Result<Response<Bytes>, HttpError> {
    let mut answer = client
        .execute(request.try_into()?)
        .await
        .map_err(reqwest::Error::without_url)?;
    let mut body = Vec::new();
    // Reads the response to its end, so that the connection can be reused.
    while let Some(chunk) = answer.chunk().await? {
        if body.len() + chunk.len() > MAX_ANSWER_BYTES {
            break;
        }
        body.extend_from_slice(&chunk);
    }
    let mut response = Response::new(body.into());
    *response.status_mut() = answer.status();
    Ok(response)
}
