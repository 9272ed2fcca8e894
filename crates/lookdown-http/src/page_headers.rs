//! Security headers for browsers.

use axum::{
    http::{
        HeaderMap, HeaderName, HeaderValue,
        header::{
            CONTENT_SECURITY_POLICY, REFERRER_POLICY, X_CONTENT_TYPE_OPTIONS, X_FRAME_OPTIONS,
        },
    },
    response::Response,
};

/// The content security policy of the web page: scripts, styles and data of this server alone, and
/// images that the user opened or the server returned.
const WEB_PAGE_POLICY: HeaderValue = HeaderValue::from_static(
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src \
     'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
);

/// The content security policy of the API page. Its script sets styles, and its styles contain
/// images.
const API_PAGE_POLICY: HeaderValue = HeaderValue::from_static(
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' \
     blob: data:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
);

/// Determines the pages that may show a response as an image or run it as a script (Fetch, section
/// 3.7).
const RESOURCE_POLICY: HeaderName = HeaderName::from_static("cross-origin-resource-policy");

/// The headers of every response. A response that is not a page loads nothing.
const ALWAYS: [(HeaderName, HeaderValue); 5] = [
    (
        CONTENT_SECURITY_POLICY,
        HeaderValue::from_static("default-src 'none'; frame-ancestors 'none'"),
    ),
    (RESOURCE_POLICY, HeaderValue::from_static("same-origin")),
    (REFERRER_POLICY, HeaderValue::from_static("no-referrer")),
    (X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff")),
    (X_FRAME_OPTIONS, HeaderValue::from_static("DENY")),
];

/// Adds the policy of the web page.
#[expect(clippy::unused_async, reason = "layers of axum are async")]
pub async fn for_web_page(response: Response) -> Response {
    with_policy(response, WEB_PAGE_POLICY)
}

/// Adds the policy of the API page.
#[expect(clippy::unused_async, reason = "layers of axum are async")]
pub async fn for_api_page(response: Response) -> Response {
    with_policy(response, API_PAGE_POLICY)
}

/// Permits pages of other origins to show a response. A server with `access.cors_origins` refuses
/// the requests of other pages itself.
#[expect(clippy::unused_async, reason = "layers of axum are async")]
pub async fn for_other_origins(mut response: Response) -> Response {
    let policy = HeaderValue::from_static("cross-origin");
    response.headers_mut().insert(RESOURCE_POLICY, policy);
    response
}

fn with_policy(mut response: Response, policy: HeaderValue) -> Response {
    let headers = response.headers_mut();
    headers.insert(CONTENT_SECURITY_POLICY, policy);
    response
}

/// Adds default headers that the response does not set itself.
pub fn complete(headers: &mut HeaderMap) {
    for (name, value) in ALWAYS {
        headers.entry(name).or_insert(value);
    }
}
