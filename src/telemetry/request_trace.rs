//! The spans of one request.

use std::{
    fmt,
    time::{Instant, SystemTime},
};

use opentelemetry::{
    Context, KeyValue, Value,
    trace::{Span, SpanBuilder, Status, TraceContextExt, TraceId, Tracer},
};
use opentelemetry_sdk::trace::SdkTracer;

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
    pub(super) fn not_recorded(context: &Context) -> Self {
        let span = context.span();
        let span = span.span_context();
        Self {
            id: span.is_valid().then(|| span.trace_id()),
            recording: None,
        }
    }

    /// Creates a request whose span is in `context`.
    pub(super) fn recorded(context: &Context, tracer: &SdkTracer) -> Self {
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
