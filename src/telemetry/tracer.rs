//! Spans for OpenTelemetry, sent with OTLP over HTTP. Whoever works never waits for them: they queue
//! within a bound, a thread of their own sends them, and those that find no place are lost.

use std::time::Duration;

use opentelemetry::{
    InstrumentationScope, KeyValue,
    trace::{SpanBuilder, SpanKind, TraceContextExt, Tracer as _, TracerProvider},
};
use opentelemetry_otlp::{Protocol, SpanExporter, WithExportConfig, WithHttpConfig};
use opentelemetry_sdk::{
    Resource,
    trace::{Sampler, SdkTracer, SdkTracerProvider},
};

use super::{IncomingTrace, RequestTrace, collector::Collector};
use crate::settings::TraceSettings;

/// Longest that the end of the server waits for the last spans.
const LAST_DELIVERY: Duration = Duration::from_secs(3);
const SIGNAL_PATH: &str = "v1/traces";

/// Why traces cannot be sent.
#[derive(Debug, thiserror::Error)]
pub enum TracerError {
    /// HTTP cannot be spoken at all.
    #[error("telemetry.otlp_endpoint: no connection can be made: {0}")]
    Client(#[from] reqwest::Error),
    /// The exporter refuses what it is told.
    #[error("telemetry.otlp_endpoint: {0}")]
    Exporter(#[from] opentelemetry_otlp::ExporterBuildError),
}

/// Makes the spans of requests. The default one records nothing. Clones share its queue.
#[derive(Debug, Clone, Default)]
pub struct Tracer(Option<Exporting>);

#[derive(Debug, Clone)]
struct Exporting {
    provider: SdkTracerProvider,
    tracer: SdkTracer,
}

impl Tracer {
    /// Starts the thread that sends spans, if the settings name a collector. Whether it answers is
    /// not asked. Needs a tokio runtime.
    ///
    /// # Errors
    /// [`TracerError`], which names the setting.
    pub fn start(settings: &TraceSettings) -> Result<Self, TracerError> {
        let Some(endpoint) = &settings.otlp_endpoint else {
            return Ok(Self::default());
        };
        let endpoint = endpoint.as_str().trim_end_matches('/');
        let exporter = SpanExporter::builder()
            .with_http()
            .with_http_client(Collector::new()?)
            .with_endpoint(format!("{endpoint}/{SIGNAL_PATH}"))
            .with_protocol(Protocol::HttpBinary)
            .build()?;
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

    /// The trace of a request that begins now. Its span ends with [`RequestTrace::end`], or with the
    /// last clone of it.
    #[must_use]
    pub fn request(&self, name: impl FnOnce() -> String, incoming: &IncomingTrace) -> RequestTrace {
        let parent = incoming.context();
        let Some(Exporting { tracer, .. }) = &self.0 else {
            return RequestTrace::not_recorded(&parent);
        };
        let span = SpanBuilder::from_name(name()).with_kind(SpanKind::Server);
        let span = tracer.build_with_context(span, &parent);
        RequestTrace::recorded(&parent.with_span(span), tracer)
    }

    /// Sends what is still in the queue, within three seconds, and no more after that. Blocks.
    pub fn shut_down(&self) {
        if let Some(Exporting { provider, .. }) = &self.0 {
            // The collector has told what went wrong.
            let _ = provider.shutdown_with_timeout(LAST_DELIVERY);
        }
    }
}
