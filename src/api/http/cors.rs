//! CORS: the origins of web pages that may call the server from a browser.

use axum::http::{
    HeaderName, HeaderValue, Method,
    header::{
        AUTHORIZATION, CONTENT_TYPE, ETAG, IF_MATCH, IF_NONE_MATCH, LOCATION, RETRY_AFTER,
        WWW_AUTHENTICATE,
    },
};
use lookdown_http::{keys::API_KEY, request_id};
use tower_http::cors::CorsLayer;

use super::rate_limit::{RATE_LIMIT, RATE_LIMIT_POLICY};

/// Returns the CORS layer for these origins; `None` if there are none. `sent` and `read` are the
/// headers of the routes that a page may send and read, besides the common ones.
pub(in crate::api) fn layer(
    origins: &[String],
    sent: &[HeaderName],
    read: &[HeaderName],
) -> Option<CorsLayer> {
    let origins = origins.iter();
    // The settings check the origins: each is a valid header value.
    let origins: Vec<_> = origins
        .filter_map(|origin| HeaderValue::from_str(origin).ok())
        .collect();
    if origins.is_empty() {
        return None;
    }
    let common_sent = [
        AUTHORIZATION,
        API_KEY,
        CONTENT_TYPE,
        IF_MATCH,
        IF_NONE_MATCH,
        request_id::HEADER,
    ];
    let common_read = [
        ETAG,
        LOCATION,
        RATE_LIMIT,
        RATE_LIMIT_POLICY,
        RETRY_AFTER,
        WWW_AUTHENTICATE,
        request_id::HEADER,
    ];
    let all = |common: &[HeaderName], others: &[HeaderName]| [common, others].concat();
    let layer = CorsLayer::new()
        .allow_origin(origins)
        .allow_methods([
            Method::GET,
            Method::POST,
            Method::PUT,
            Method::PATCH,
            Method::DELETE,
        ])
        .allow_headers(all(&common_sent, sent))
        .expose_headers(all(&common_read, read));
    Some(layer)
}
