//! The trace context of an incoming request.

use axum::http::HeaderMap;

use crate::telemetry::{RequestTrace, Tracer};

/// Begins the span of a request in the trace of its `traceparent` header, if there is one.
pub(in crate::api) fn begin(
    tracer: &Tracer,
    name: impl FnOnce() -> String,
    headers: &HeaderMap,
) -> RequestTrace {
    let mut parents = headers.get_all("traceparent").iter();
    let parent = parents.next().filter(|_| parents.next().is_none());
    let states = headers.get_all("tracestate").iter();
    let states: Vec<_> = states.filter_map(|state| state.to_str().ok()).collect();
    let states = states.join(",");
    let incoming = crate::telemetry::IncomingTrace {
        parent: parent.and_then(|parent| parent.to_str().ok()),
        state: Some(states.as_str()).filter(|states| !states.is_empty()),
    };
    tracer.request(name, &incoming)
}
