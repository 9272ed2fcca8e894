//! Logs and traces. Metrics are in `metrics`.
//!
//! Logs go to standard error. Standard output is reserved for reports.
//!
//! OpenTelemetry spans, sent with OTLP over HTTP. Requests never wait for the export: spans wait in
//! a bounded queue, a separate thread sends them, and spans that find the queue full are lost.
//!
//! The incoming trace of a request, according to W3C Trace Context.
//! Source: W3C Recommendation "Trace Context", section 3, "Trace Context HTTP Headers Format".
//!
//! The HTTP client of the trace collector. Requests have a timeout, and only the first failure of
//! an outage is logged.

use std::{
    fmt,
    io::IsTerminal,
    sync::atomic::{AtomicBool, Ordering},
    time::{Duration, Instant, SystemTime},
};

use anyhow::Context as _;
use async_trait::async_trait;
use lookdown_common::text::with_causes;
use opentelemetry::{
    Context, InstrumentationScope, KeyValue, Value,
    propagation::{Extractor, TextMapPropagator},
    trace::{
        Span, SpanBuilder, SpanKind, Status, TraceContextExt, TraceId, Tracer as _, TracerProvider,
    },
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
use tracing::{Subscriber, level_filters::LevelFilter};
use tracing_subscriber::{
    filter::Targets,
    fmt::MakeWriter,
    layer::SubscriberExt,
    util::{SubscriberInitExt, TryInitError},
};

use crate::settings::{LogFormat, LogSettings, TraceSettings};

/// Starts logging, including that of panics.
///
/// # Errors
/// If logging was already started in this process.
pub fn start_logs(settings: &LogSettings) -> Result<(), TryInitError> {
    let in_color = std::io::stderr().is_terminal();
    log_subscriber(settings, std::io::stderr, in_color).try_init()?;
    std::panic::set_hook(Box::new(|panic| {
        let thread = std::thread::current();
        tracing::error!(thread = thread.name().unwrap_or("unnamed"), "{panic}");
    }));
    Ok(())
}

/// Returns the subscriber that writes log lines according to the settings. Lines of a request carry
/// its fields: in text before the message, in JSON in the object `span`.
pub fn log_subscriber(
    settings: &LogSettings,
    writer: impl for<'writer> MakeWriter<'writer> + Send + Sync + 'static,
    in_color: bool,
) -> Box<dyn Subscriber + Send + Sync> {
    let logs = tracing_subscriber::fmt()
        .with_writer(writer)
        .with_ansi(in_color)
        .with_max_level(LevelFilter::TRACE);
    // The setting was parsed when it was read.
    let filter: Targets = settings.filter.parse().unwrap_or_default();
    match settings.format {
        LogFormat::Text => Box::new(logs.finish().with(filter)),
        LogFormat::Json => {
            let logs = logs.json().flatten_event(true).with_span_list(false);
            Box::new(logs.finish().with(filter))
        }
    }
}

/// The spans of one request. Clones share them.
#[derive(Debug, Clone)]
pub struct RequestTrace {
    id: Option<TraceId>,
    recording: Option<Recording>,
}

#[derive(Debug, Clone)]
struct Recording {
    /// Holds the request's span.
    context: Context,
    tracer: SdkTracer,
    /// The same moment on both clocks: spans keep their lengths when the system time is changed.
    moment: (Instant, SystemTime),
}

impl RequestTrace {
    /// Creates a request without spans. Its trace ID may still be known.
    fn not_recorded(context: &Context) -> Self {
        let span = context.span();
        let span = span.span_context();
        Self {
            id: span.is_valid().then(|| span.trace_id()),
            recording: None,
        }
    }

    /// Creates a request whose span is in `context`.
    fn recorded(context: &Context, tracer: &SdkTracer) -> Self {
        let trace = Self::not_recorded(context);
        let moment = (Instant::now(), SystemTime::now());
        let recording = context.span().is_recording().then(|| Recording {
            context: context.clone(),
            tracer: tracer.clone(),
            moment,
        });
        Self { recording, ..trace }
    }

    /// The ID of the trace, 32 hexadecimal digits. `None` if the request belongs to no trace.
    pub fn id(&self) -> Option<impl fmt::Display + use<>> {
        self.id
    }

    /// Adds an attribute to the span of the request.
    pub fn note(&self, key: &'static str, value: impl Into<Value>) {
        if let Some(Recording { context, .. }) = &self.recording {
            context.span().set_attribute(KeyValue::new(key, value));
        }
    }

    /// Adds a child span of the request.
    pub fn stage(&self, name: &'static str, began: Instant, ended: Instant) {
        if let Some(recording) = &self.recording {
            let span = SpanBuilder::from_name(name).with_start_time(recording.by_calendar(began));
            let mut span = recording
                .tracer
                .build_with_context(span, &recording.context);
            span.end_with_timestamp(recording.by_calendar(ended));
        }
    }

    /// Ends the span of the request. `fault` is the error of this server, if there is one.
    pub fn end(&self, fault: Option<&'static str>) {
        if let Some(Recording { context, .. }) = &self.recording {
            if let Some(fault) = fault {
                context.span().set_status(Status::error(fault));
            }
            context.span().end();
        }
    }
}

impl Recording {
    fn by_calendar(&self, at: Instant) -> SystemTime {
        let (moment, by_calendar) = self.moment;
        match at.checked_duration_since(moment) {
            Some(later) => by_calendar + later,
            None => by_calendar - (moment - at),
        }
    }
}

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
    fn context(&self) -> Context {
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
