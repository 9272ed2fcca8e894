//! OpenTelemetry spans, sent with OTLP over HTTP. Requests never wait for the export: spans wait in
//! a bounded queue, a separate thread sends them, and spans that find the queue full are lost.

use std::time::Duration;

use anyhow::Context;
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

    /// Sends the spans in the queue within three seconds, and none after that. Blocks.
    pub fn shut_down(&self) {
        if let Some(Exporting { provider, .. }) = &self.0 {
            // The collector has already logged a failure.
            let _ = provider.shutdown_with_timeout(LAST_DELIVERY);
        }
    }
}
