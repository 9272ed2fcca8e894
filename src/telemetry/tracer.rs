//! OpenTelemetry spans, sent with OTLP over HTTP. Requests never wait for the export: spans wait in
//! a bounded queue, a separate thread sends them, and spans that find the queue full are lost.
//!
//! The incoming trace of a request, according to W3C Trace Context.
//! Source: W3C Recommendation "Trace Context", section 3, "Trace Context HTTP Headers Format".
//!
//! The HTTP client of the trace collector. Requests have a timeout, and only the first failure of
//! an outage is logged.

use std::{
    sync::atomic::{AtomicBool, Ordering},
    time::Duration,
};

use anyhow::Context as _;
use async_trait::async_trait;
use lookdown_common::text::with_causes;
use opentelemetry::{
    Context, InstrumentationScope, KeyValue,
    propagation::{Extractor, TextMapPropagator},
    trace::{SpanBuilder, SpanKind, TraceContextExt, Tracer as _, TracerProvider},
};
use opentelemetry_http::{Bytes, HttpClient, HttpError, Request, Response};
use opentelemetry_otlp::{Protocol, SpanExporter, WithExportConfig, WithHttpConfig};
use opentelemetry_sdk::{
    Resource,
    propagation::TraceContextPropagator,
    trace::{Sampler, SdkTracer, SdkTracerProvider},
};
use reqwest::{Client, redirect};
use tokio::runtime::Handle;

use super::RequestTrace;
use crate::settings::TraceSettings;

/// Longest time that the shutdown waits for the last spans.
const LAST_DELIVERY: Duration = Duration::from_secs(3);
const SIGNAL_PATH: &str = "v1/traces";

/// Creates the spans of requests. The default one records nothing. Clones share its queue.
#[derive(Debug, Clone, Default)]
pub struct Tracer(Option<Exporting>);

#[derive(Debug, Clone)]
struct Exporting {
    provider: SdkTracerProvider,
    tracer: SdkTracer,
}

impl Tracer {
    /// Starts the thread that sends spans, if the settings name a collector. Does not check that
    /// the collector answers. Needs a tokio runtime.
    ///
    /// # Errors
    /// If no connection can be made. The error names the setting.
    pub fn start(settings: &TraceSettings) -> anyhow::Result<Self> {
        let Some(endpoint) = &settings.otlp_endpoint else {
            return Ok(Self::default());
        };
        let endpoint = endpoint.as_str().trim_end_matches('/');
        let client = Collector::new();
        let client = client.context("telemetry.otlp_endpoint: no connection can be made")?;
        let exporter = SpanExporter::builder()
            .with_http()
            .with_http_client(client)
            .with_endpoint(format!("{endpoint}/{SIGNAL_PATH}"))
            .with_protocol(Protocol::HttpBinary)
            .build()
            .context("telemetry.otlp_endpoint")?;
        let version = KeyValue::new("service.version", env!("CARGO_PKG_VERSION"));
        let resource = Resource::builder()
            .with_service_name(settings.service_name.clone())
            .with_attribute(version)
            .build();
        let own_choice = Sampler::TraceIdRatioBased(settings.sample_ratio);
        let provider = SdkTracerProvider::builder()
            .with_batch_exporter(exporter)
            .with_resource(resource)
            .with_sampler(Sampler::ParentBased(Box::new(own_choice)))
            .build();
        let scope = InstrumentationScope::builder(env!("CARGO_PKG_NAME"))
            .with_version(env!("CARGO_PKG_VERSION"))
            .build();
        let tracer = provider.tracer_with_scope(scope);
        Ok(Self(Some(Exporting { provider, tracer })))
    }

    /// Starts the trace of a request. Its span ends with [`RequestTrace::end`], or with its last
    /// clone.
    pub fn request(&self, name: impl FnOnce() -> String, incoming: &IncomingTrace) -> RequestTrace {
        let parent = incoming.context();
        let Some(Exporting { tracer, .. }) = &self.0 else {
            return RequestTrace::not_recorded(&parent);
        };
        let span = SpanBuilder::from_name(name()).with_kind(SpanKind::Server);
        let span = tracer.build_with_context(span, &parent);
        RequestTrace::recorded(&parent.with_span(span), tracer)
    }

    /// Sends the spans in the queue within three seconds, and none after that. Blocks.
    pub fn shut_down(&self) {
        if let Some(Exporting { provider, .. }) = &self.0 {
            // The collector has already logged a failure.
            let _ = provider.shutdown_with_timeout(LAST_DELIVERY);
        }
    }
}

/// Lengths of version, trace ID, parent ID and flags.
const PART_LENGTHS: [usize; 4] = [2, 32, 16, 2];

/// The trace headers of a request.
#[derive(Debug, Clone, Copy, Default)]
pub struct IncomingTrace<'a> {
    /// `traceparent`. `None` also if there are several.
    pub parent: Option<&'a str>,
    /// `tracestate`. Several are joined with commas.
    pub state: Option<&'a str>,
}

impl IncomingTrace<'_> {
    /// Returns a context with the caller's span as parent, or without a span if the headers name
    /// none.
    pub(super) fn context(&self) -> Context {
        if self.parent.is_none() {
            return Context::new();
        }
        TraceContextPropagator::new().extract_with_context(&Context::new(), self)
    }
}

impl Extractor for IncomingTrace<'_> {
    fn get(&self, key: &str) -> Option<&str> {
        match key {
            "traceparent" => self.parent.filter(|parent| is_well_formed(parent)),
            "tracestate" => self.state,
            _ => None,
        }
    }

    fn keys(&self) -> Vec<&str> {
        vec!["traceparent", "tracestate"]
    }
}

/// Returns true if all parts are present. The propagator validates their values.
fn is_well_formed(parent: &str) -> bool {
    let mut parts = parent.split('-');
    PART_LENGTHS.into_iter().all(|length| {
        parts.next().is_some_and(|part| {
            part.len() == length && part.bytes().all(|byte| byte.is_ascii_hexdigit())
        })
    })
}

/// Longest time for one delivery.
const DELIVERY_TIMEOUT: Duration = Duration::from_secs(5);
/// Most bytes of a response that are read.
const MAX_ANSWER_BYTES: usize = 64 * 1024;

/// Delivers the spans that the exporter has serialized.
#[derive(Debug)]
struct Collector {
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
    fn new() -> reqwest::Result<Self> {
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

#[cfg(test)]
mod tests {
    use opentelemetry::trace::TraceContextExt;

    use super::*;

    fn trace_of(parent: &str, state: Option<&str>) -> Option<(String, String)> {
        let parent = Some(parent);
        let context = IncomingTrace { parent, state }.context();
        let span = context.span();
        let span = span.span_context();
        span.is_valid()
            .then(|| (span.trace_id().to_string(), span.trace_state().header()))
    }

    #[test]
    fn a_parent_is_known_and_so_is_one_of_a_later_version() {
        let trace = "4bf92f3577b34da6a3ce929d0e0e4736";
        for parent in [
            format!("00-{trace}-00f067aa0ba902b7-01"),
            format!("cc-{trace}-00f067aa0ba902b7-00-more"),
        ] {
            let known = trace_of(&parent, Some("a=1,b=2")).unwrap();
            assert_eq!(known, (trace.to_owned(), "a=1,b=2".to_owned()));
            // An invalid state is ignored without affecting the parent.
            let known = trace_of(&parent, Some("nonsense")).unwrap();
            assert_eq!(known, (trace.to_owned(), String::new()));
        }
    }

    #[test]
    fn an_invalid_parent_is_ignored() {
        for parent in [
            "",
            "00",
            "00-1-1-01",
            "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7",
            "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01-more",
            "ff-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",
            "00-4BF92F3577B34DA6A3CE929D0E0E4736-00f067aa0ba902b7-01",
            "00-+bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",
            "00-00000000000000000000000000000000-00f067aa0ba902b7-01",
            "00-4bf92f3577b34da6a3ce929d0e0e4736-0000000000000000-01",
            "00-4bf92f3577b34da6a3ce929d0e0e473\u{e9}-00f067aa0ba902b7-01",
        ] {
            assert_eq!(trace_of(parent, None), None, "{parent}");
        }
    }
}
