//! Counts and furniture on the port of the server: those of this process, or of a `lookdown count`
//! on another host.

use std::time::Duration;

use axum::{
    Router,
    body::{Body, to_bytes},
    extract::{Request, State},
    http::{
        Method, StatusCode, Uri,
        header::{ACCEPT, CACHE_CONTROL, CONTENT_TYPE, ETAG, IF_NONE_MATCH},
    },
    response::Response,
    routing::{get, put},
};
use lookdown_common::ServerClient;
use percent_encoding::{NON_ALPHANUMERIC, percent_decode_str, utf8_percent_encode};
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
/// The detail of an unknown path.
const NO_RESOURCE: &str = "there is no such resource: docs/count.md lists all paths";
/// The media types of counts.
const MEDIA_TYPES: [&str; 5] = [
    "application/json",
    "application/problem+json",
    "image/png",
    "image/svg+xml",
    "text/csv",
];
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
    let paths = ["/counts", "/sites/{*path}"];
    let router = paths
        .into_iter()
        .fold(Router::new(), |router, path| router.route(path, get(read)));
    let thing = "/cameras/{camera}/furniture/{thing}";
    router
        .route("/counts/{*path}", get(read).put(change).delete(change))
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

/// Removes a camera from the counts, which keep its history. Returns false if they do not have it.
pub(in crate::api) async fn remove(state: &ApiState, camera: &str) -> bool {
    let camera = utf8_percent_encode(camera, NON_ALPHANUMERIC);
    let request = Request::delete(format!("/counts/{camera}?keep_history=true"));
    match request.body(Body::empty()) {
        Ok(request) => answer(state, request).await.is_ok(),
        Err(_) => false,
    }
}

async fn answer(state: &ApiState, mut request: Request) -> Result<Response, Problem> {
    // The routes would add the parameters of their path to those of the path here.
    request.extensions_mut().clear();
    let response = match state.options.companions.counts() {
        Counts::Here(routes) => match routes.oneshot(request).await {
            Ok(response) => response,
            Err(never) => match never {},
        },
        Counts::Elsewhere(client) => {
            let outgoing = outgoing(&client, &request)?;
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
        status if status.is_success() || status == StatusCode::NOT_MODIFIED => Ok(response),
        status => Err(problem(status, response).await),
    }
}

/// Returns the request to another host.
fn outgoing(client: &ServerClient, request: &Request) -> Result<RequestBuilder, Problem> {
    let url = url(client, request.uri())?;
    let method = match request.method() {
        &Method::HEAD => Method::GET,
        method => method.clone(),
    };
    let mut outgoing = client.request(method, url).timeout(TIMEOUT);
    for name in [ACCEPT, IF_NONE_MATCH] {
        if let Some(value) = request.headers().get(&name) {
            outgoing = outgoing.header(name, value);
        }
    }
    Ok(outgoing)
}

/// Requests the counts of another host with the key of that host: the key of the caller was checked
/// here.
async fn forward(client: &ServerClient, outgoing: RequestBuilder) -> Result<Response, Problem> {
    let answered = client.send(outgoing).await.map_err(|error| {
        tracing::warn!("counts.url: {}", client.failure(&error));
        unavailable("the counts do not respond: the log of the server has the reason; retry")
    })?;
    let media_type = answered.headers().get(CONTENT_TYPE);
    let media_type = media_type.map(|value| value.to_str().unwrap_or_default());
    let is_known = |value: &str| {
        let essence = value.split(';').next().unwrap_or_default().trim();
        MEDIA_TYPES.contains(&essence)
    };
    if answered.status().is_success() && !media_type.is_none_or(is_known) {
        tracing::warn!("counts.url: it answers with another media type than `lookdown count`");
        return Err(unavailable(
            "counts.url is not a `lookdown count`: correct it",
        ));
    }
    let mut response = Response::new(Body::empty());
    *response.status_mut() = answered.status();
    for name in [CONTENT_TYPE, CACHE_CONTROL, ETAG] {
        if let Some(value) = answered.headers().get(&name) {
            response.headers_mut().insert(name, value.clone());
        }
    }
    let (_, body) = axum::http::Response::<reqwest::Body>::from(answered).into_parts();
    *response.body_mut() = Body::new(body);
    Ok(response)
}

/// Returns the URL of a path and a query on the other host.
///
/// # Errors
/// [`Problem`] if the path leaves its place.
fn url(client: &ServerClient, uri: &Uri) -> Result<Url, Problem> {
    let segments = uri.path().split('/').skip(1);
    let segments = segments.map(|segment| percent_decode_str(segment).decode_utf8());
    let segments = segments.collect::<Result<Vec<_>, _>>().ok();
    let segments =
        segments.filter(|segments| !segments.iter().any(|name| name == "." || name == ".."));
    let Some(segments) = segments else {
        return Err(Problem::new(ProblemKind::NotFound, NO_RESOURCE));
    };
    let mut url = client.route(segments.iter().map(AsRef::as_ref));
    url.set_query(uri.query());
    Ok(url)
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
        return Problem::new(kind, NO_RESOURCE);
    }
    Problem::new(kind, failure.detail)
}

#[cfg(test)]
mod tests {
    use lookdown_common::{OwnCameras, ServerOptions};

    use super::*;
    use crate::api::in_process;

    fn client(routes: Router) -> ServerClient {
        ServerClient::new(&ServerOptions {
            url: Url::parse("http://counts.example/prefix/").unwrap(),
            api_key: None,
            authorities: None,
            in_process: Some(in_process(routes, OwnCameras::default(), |_| 0)),
        })
        .unwrap()
    }

    #[test]
    fn a_forwarded_path_stays_in_its_place() {
        let client = client(Router::new());
        let forwarded = |path: &str| Some(url(&client, &path.parse().unwrap()).ok()?.to_string());
        for path in [
            "/counts/../results",
            "/counts/%2e%2e/%2E%2e/metrics?a=b",
            "/cameras/.%2e/furniture",
            "/cameras/./furniture/x",
            "/counts/%ff",
        ] {
            assert_eq!(forwarded(path), None, "{path}");
        }
        for (path, expected) in [
            ("/counts/hall?step=hour", "counts/hall?step=hour"),
            ("/counts/a%2F..%2fb%5C..%5cc", "counts/a%2F..%2Fb%5C..%5Cc"),
            ("/counts/a%20%C3%A4%3F%23", "counts/a%20%C3%A4%3F%23"),
            ("/counts//x", "counts//x"),
        ] {
            let expected = format!("http://counts.example/prefix/{expected}");
            assert_eq!(forwarded(path), Some(expected));
        }
    }

    #[tokio::test]
    async fn only_media_types_of_counts_are_forwarded() {
        let html = get(|| async { ([(CONTENT_TYPE, "text/html")], "<script>") });
        let routes = Router::new()
            .route("/prefix/counts/html", html)
            .route("/prefix/counts/json", get(|| async { axum::Json(1) }));
        let client = client(routes);
        for (name, is_forwarded) in [("html", false), ("json", true)] {
            let path = format!("/counts/{name}");
            let request = Request::get(path).body(Body::empty()).unwrap();
            let answer = forward(&client, outgoing(&client, &request).unwrap()).await;
            assert_eq!(answer.is_ok(), is_forwarded, "{name}");
        }
    }
}
