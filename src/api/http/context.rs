//! The context of a request: its ID, trace, deadline and caller. The outermost layer determines it
//! once from the head of the request, and everything else reads it.
//!
//! The trace context of an incoming request.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use axum::{
    extract::FromRequestParts,
    http::{Extensions, HeaderMap, request::Parts},
};
use lookdown_http::request_id::RequestId;

use super::{
    access::{Access, Caller},
    deadline::Deadline,
    problem::Problem,
};
use crate::{
    access::Holder,
    telemetry::{RequestTrace, Tracer},
};

/// The settings of the contexts.
#[derive(Clone)]
pub(in crate::api) struct ContextSource {
    pub(in crate::api) tracer: Tracer,
    pub(in crate::api) access: Access,
    /// The longest duration of a request, from its first byte to its response.
    pub(in crate::api) request_timeout: Duration,
}

/// The mark of a request of this process.
#[derive(Clone, Copy)]
pub(in crate::api) struct OwnRequest;

/// The facts that follow from the head of a request.
pub(in crate::api) struct RequestContext {
    pub(in crate::api) id: RequestId,
    pub(in crate::api) trace: RequestTrace,
    /// The deadline of the response.
    pub(in crate::api) deadline: Deadline,
    /// The holder of the key in the headers: keys are compared here, once for each request.
    pub(in crate::api) holder: Option<Holder>,
    pub(in crate::api) caller: Caller,
    /// True if a part of this process sent the request.
    pub(in crate::api) is_own: bool,
}

impl ContextSource {
    /// Determines the context of a request, and adds it to the request. `name` is that of its span.
    pub(in crate::api) fn begin(
        &self,
        parts: &mut Parts,
        name: impl FnOnce() -> String,
    ) -> Arc<RequestContext> {
        let id = RequestId::from_headers(&parts.headers);
        let holder = self.access.identify(&parts.headers);
        let context = Arc::new(RequestContext {
            trace: begin_trace(&self.tracer, name, &parts.headers),
            deadline: Deadline::begin(self.request_timeout),
            caller: Caller::new(&self.access, holder.as_ref(), &id, parts),
            is_own: parts.extensions.get::<OwnRequest>().is_some(),
            holder,
            id,
        });
        parts.extensions.insert(Arc::clone(&context));
        context
    }
}

impl RequestContext {
    /// Returns the context of the request with these extensions.
    ///
    /// # Errors
    /// [`Problem`] if the route is outside of the layer that determines it.
    pub(in crate::api) fn from_extensions(extensions: &Extensions) -> Result<Arc<Self>, Problem> {
        extensions.get().cloned().ok_or_else(Problem::fault)
    }

    /// Adds the upload to the trace: the time until the whole body was in memory.
    pub(in crate::api) fn note_upload(&self, arrived: Instant) {
        let began = self.deadline.began.into_std();
        self.trace.stage("upload", began, arrived);
    }
}

impl<S: Sync> FromRequestParts<S> for Deadline {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Problem> {
        Ok(RequestContext::from_extensions(&parts.extensions)?.deadline)
    }
}

impl<S: Sync> FromRequestParts<S> for Caller {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Problem> {
        Ok(RequestContext::from_extensions(&parts.extensions)?
            .caller
            .clone())
    }
}

/// Begins the span of a request in the trace of its `traceparent` header, if there is one.
fn begin_trace(
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
