//! The layer around every request: request ID, log line, metrics and problem documents.

use std::{any::Any, sync::Arc, time::Instant};

use axum::{
    extract::{MatchedPath, Request, State},
    http::{Method, StatusCode},
    middleware::Next,
    response::{IntoResponse, Response},
};
use lookdown_http::{
    page_headers,
    problem::with_document,
    request_id::{self, new_id},
};
use tracing::Instrument;
use uuid::Uuid;

use super::{
    context::ContextSource,
    problem::{Problem, ProblemKind},
};
use crate::{metrics::Metrics, telemetry::RequestTrace};

/// The route label of requests that match no route.
const UNMATCHED: &str = "unmatched";
/// The log target of the access log, for `log.filter`.
const ACCESS_LOG: &str = "lookdown::access";

/// The state of this layer.
#[derive(Clone)]
pub(in crate::api) struct Envelope {
    pub(in crate::api) metrics: Arc<Metrics>,
    pub(in crate::api) contexts: ContextSource,
}

/// The problem of a failed request, for the log.
struct Failure {
    /// The name of its kind.
    reason: &'static str,
    /// The ID of the occurrence: the `instance` of the problem document.
    occurrence: Uuid,
}

/// Returns the response to a request whose handler panicked.
pub(in crate::api) fn panic_response(_: Box<dyn Any + Send>) -> Response {
    Problem::fault().into_response()
}

/// Adds the context of the request, the request ID, the access log line, the metrics and the
/// problem document.
pub(in crate::api) async fn wrap(
    State(Envelope { metrics, contexts }): State<Envelope>,
    request: Request,
    next: Next,
) -> Response {
    let started = Instant::now();
    let (mut parts, body) = request.into_parts();
    let method = method_label(&parts.method);
    let path = parts.uri.path().to_owned();
    let route = parts.extensions.get::<MatchedPath>().cloned();
    let route = route.as_ref().map_or(UNMATCHED, MatchedPath::as_str);
    let context = contexts.begin(&mut parts, || format!("{method} {route}"));
    let (request_id, trace) = (&context.id, &context.trace);
    let request = Request::from_parts(parts, body);

    // The span has the highest level, so no filter removes the request ID from a line.
    let span = tracing::error_span!(
        "request",
        request_id = request_id.as_str(),
        trace_id = trace.id().map(tracing::field::display),
        method,
        route
    );
    let mut response = next.run(request).instrument(span.clone()).await;
    let _in_request = span.enter();
    let mut failure = None;
    if let Some(problem) = Problem::take_from(&mut response, method, &path) {
        let (reason, occurrence) = (problem.kind.name(), new_id());
        failure = Some(Failure { reason, occurrence });
        metrics.failures.with_label_values(&[reason]).inc();
        if let Some(cause) = &problem.cause {
            tracing::error!(instance = %occurrence, "{cause:#}");
        }
        let status = problem.status;
        let document = problem.body(&occurrence, request_id.as_str());
        response = with_document(response, status, document);
    }
    let status = response.status();
    let class = status_class(status);
    metrics
        .http_requests
        .with_label_values(&[route, method, class])
        .inc();
    let elapsed = started.elapsed().as_secs_f64();
    metrics
        .http_request_duration
        .with_label_values(&[route, method])
        .observe(elapsed);
    log_answer(status, elapsed, failure.as_ref());
    trace.note("http.request.method", method);
    trace.note("http.route", route.to_owned());
    trace.note("http.response.status_code", i64::from(status.as_u16()));
    trace.note("url.path", path);
    trace.note("lookdown.request_id", request_id.as_str().to_owned());
    end(trace, status, failure.map(|failure| failure.reason));
    let headers = response.headers_mut();
    headers.insert(request_id::HEADER, request_id.header_value());
    page_headers::complete(headers);
    response
}

/// Writes the access log line: level info for unexpected server errors, otherwise debug.
fn log_answer(status: StatusCode, seconds: f64, failure: Option<&Failure>) {
    let code = status.as_u16();
    let reason = failure.map(|failure| failure.reason);
    let instance = failure.map(|failure| tracing::field::display(failure.occurrence));
    if is_unexpected(status, reason) {
        tracing::info!(target: ACCESS_LOG, status = code, seconds, reason, instance, "answered");
    } else {
        tracing::debug!(target: ACCESS_LOG, status = code, seconds, reason, instance, "answered");
    }
}

/// Returns true for server errors, except those of clients that poll while the server starts.
fn is_unexpected(status: StatusCode, reason: Option<&str>) -> bool {
    status.is_server_error() && reason != Some(ProblemKind::WarmingUp.name())
}

/// Ends the span of the request. Only server errors set its error status.
fn end(trace: &RequestTrace, status: StatusCode, reason: Option<&'static str>) {
    if let Some(reason) = reason {
        trace.note("error.type", reason);
    }
    let fault = reason.filter(|_| status.is_server_error());
    trace.end(fault);
}

/// Returns a metric label from a fixed list: clients can send arbitrary methods.
fn method_label(method: &Method) -> &'static str {
    match *method {
        Method::GET => "GET",
        Method::HEAD => "HEAD",
        Method::POST => "POST",
        Method::PUT => "PUT",
        Method::DELETE => "DELETE",
        Method::OPTIONS => "OPTIONS",
        Method::PATCH => "PATCH",
        _ => "other",
    }
}

fn status_class(status: StatusCode) -> &'static str {
    match status.as_u16() / 100 {
        2 => "2xx",
        3 => "3xx",
        4 => "4xx",
        5 => "5xx",
        _ => "1xx",
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use axum::{Router, body::Body, http::header, middleware::from_fn_with_state, routing::get};
    use http_body_util::BodyExt;
    use tower::ServiceExt;
    use tower_http::catch_panic::CatchPanicLayer;

    use super::*;
    use crate::{api::http::access::Access, telemetry::Tracer};

    #[tokio::test]
    async fn a_panicking_handler_costs_one_request_and_reveals_nothing() {
        async fn panics() -> &'static str {
            panic!("the secret cause")
        }
        let metrics = Arc::<Metrics>::default();
        let envelope = Envelope {
            metrics: Arc::clone(&metrics),
            contexts: ContextSource {
                tracer: Tracer::default(),
                access: Access::Open {
                    own_machine_only: true,
                },
                request_timeout: Duration::from_secs(1),
            },
        };
        let router = Router::new()
            .route("/panics", get(panics))
            .route("/works", get(async || "fine"))
            .layer(CatchPanicLayer::custom(panic_response))
            .layer(from_fn_with_state(envelope, wrap));

        let get = |path| Request::get(path).body(Body::empty()).unwrap();
        let response = router.clone().oneshot(get("/panics")).await.unwrap();
        assert_eq!(response.status(), StatusCode::INTERNAL_SERVER_ERROR);
        let media_type = &response.headers()[header::CONTENT_TYPE];
        assert_eq!(media_type, "application/problem+json");
        let body = response.into_body().collect().await.unwrap().to_bytes();
        let body = String::from_utf8_lossy(&body);
        assert!(body.contains("/problems/internal"), "{body}");
        assert!(!body.contains("secret"), "{body}");
        assert_eq!(metrics.failures.with_label_values(&["internal"]).get(), 1);

        let response = router.oneshot(get("/works")).await.unwrap();
        assert_eq!(response.status(), StatusCode::OK);
    }
}
