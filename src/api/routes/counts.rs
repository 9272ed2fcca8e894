//! Counts and furniture on the port of the server: those of this process, or of a `lookdown count`
//! on another host.

use std::time::Duration;

use axum::{
    Router,
    body::{Body, to_bytes},
    extract::{Request, State},
    http::{
        Method, StatusCode, Uri,
        header::{ACCEPT, CACHE_CONTROL, CONTENT_TYPE},
    },
    response::Response,
    routing::{get, put},
};
use lookdown_common::ServerClient;
use reqwest::RequestBuilder;
use serde::Deserialize;
use tower::ServiceExt;
use url::Url;

use crate::api::{
    ApiState,
    companions::Counts,
    http::problem::{Problem, ProblemKind},
    require_scope::{RequireAdmin, RequireRead},
};

/// Longest time for an answer of another host.
const TIMEOUT: Duration = Duration::from_secs(20);
/// Largest problem document that is read.
const MAX_PROBLEM_BYTES: usize = 64 << 10;

/// The parts of a problem document that are used.
#[derive(Default, Deserialize)]
#[serde(default)]
struct Failure {
    detail: String,
}

/// Returns the routes of the counts and the furniture. docs/count.md describes them.
pub(in crate::api) fn router() -> Router<ApiState> {
    let paths = ["/counts", "/counts/{*path}", "/sites/{*path}"];
    let router = paths
        .into_iter()
        .fold(Router::new(), |router, path| router.route(path, get(read)));
    let thing = "/cameras/{camera}/furniture/{thing}";
    router
        .route("/cameras/{camera}/furniture", get(read))
        .route(thing, put(change).delete(change))
}

async fn read(
    State(state): State<ApiState>,
    _reader: RequireRead,
    request: Request,
) -> Result<Response, Problem> {
    answer(&state, request).await
}

async fn change(
    State(state): State<ApiState>,
    _admin: RequireAdmin,
    request: Request,
) -> Result<Response, Problem> {
    answer(&state, request).await
}

async fn answer(state: &ApiState, request: Request) -> Result<Response, Problem> {
    let response = match state.options.companions.counts() {
        Counts::Here(routes) => match routes.oneshot(without_extensions(request)).await {
            Ok(response) => response,
            Err(never) => match never {},
        },
        Counts::Elsewhere(client) => {
            let outgoing = outgoing(&client, &request);
            forward(&client, outgoing).await?
        }
        Counts::Starting => return Err(unavailable("the counts are being started: retry")),
        Counts::None => {
            let detail = "this server has no counts: start `lookdown run`, or set counts.url to \
                          the address of a `lookdown count`";
            return Err(Problem::new(ProblemKind::NotFound, detail));
        }
    };
    match response.status() {
        status if status.is_success() => Ok(response),
        status => Err(problem(status, response).await),
    }
}

/// Returns the request without the parameters of its path here, which the routes would add theirs
/// to.
fn without_extensions(request: Request) -> Request {
    let (parts, body) = request.into_parts();
    let mut request = Request::new(body);
    *request.method_mut() = parts.method;
    *request.uri_mut() = parts.uri;
    *request.headers_mut() = parts.headers;
    request
}

/// Returns the request to another host.
fn outgoing(client: &ServerClient, request: &Request) -> RequestBuilder {
    let url = url(client, request.uri());
    let outgoing = match *request.method() {
        Method::PUT => client.put(url),
        Method::DELETE => client.delete(url),
        _ => client.get(url),
    };
    let outgoing = outgoing.timeout(TIMEOUT);
    match request.headers().get(ACCEPT) {
        Some(accept) => outgoing.header(ACCEPT, accept),
        None => outgoing,
    }
}

/// Requests the counts of another host with the key of that host: the key of the caller was checked
/// here.
async fn forward(client: &ServerClient, outgoing: RequestBuilder) -> Result<Response, Problem> {
    let answered = client.send(outgoing).await.map_err(|error| {
        tracing::warn!("counts.url: {}", client.failure(&error));
        unavailable("the counts do not respond: the log of the server has the reason; retry")
    })?;
    let mut response = Response::new(Body::empty());
    *response.status_mut() = answered.status();
    for name in [CONTENT_TYPE, CACHE_CONTROL] {
        if let Some(value) = answered.headers().get(&name) {
            response.headers_mut().insert(name, value.clone());
        }
    }
    let (_, body) = axum::http::Response::<reqwest::Body>::from(answered).into_parts();
    *response.body_mut() = Body::new(body);
    Ok(response)
}

/// Returns the URL of a path and a query on the other host.
fn url(client: &ServerClient, uri: &Uri) -> Url {
    let mut url = client.route([]);
    let path = format!("{}{}", url.path().trim_end_matches('/'), uri.path());
    url.set_path(&path);
    url.set_query(uri.query());
    url
}

fn unavailable(detail: &str) -> Problem {
    Problem::new(ProblemKind::CountsUnavailable, detail)
}

/// Returns the failure as a problem of this server.
async fn problem(status: StatusCode, response: Response) -> Problem {
    let kind = match status {
        StatusCode::NOT_FOUND => ProblemKind::NotFound,
        StatusCode::METHOD_NOT_ALLOWED => ProblemKind::MethodNotAllowed,
        StatusCode::UNPROCESSABLE_ENTITY => ProblemKind::InvalidParameter,
        StatusCode::INTERNAL_SERVER_ERROR => return Problem::fault(),
        _ => {
            tracing::warn!("counts.url: the counts answered {status}");
            return unavailable("the counts refuse the request: check counts.api_key_file");
        }
    };
    if let Some(problem) = response
        .extensions()
        .get::<lookdown_http::problem::Problem>()
    {
        return Problem::new(kind, problem.detail.clone());
    }
    let body = to_bytes(response.into_body(), MAX_PROBLEM_BYTES).await;
    let failure: Failure = serde_json::from_slice(&body.unwrap_or_default()).unwrap_or_default();
    if failure.detail.is_empty() {
        return Problem::new(
            kind,
            "there is no such resource: docs/count.md lists all paths",
        );
    }
    Problem::new(kind, failure.detail)
}
