//! CORS: the origins of web pages that may call the server from a browser.

use axum::http::{
    HeaderName, HeaderValue, Method,
    header::{
        AUTHORIZATION, CONTENT_TYPE, ETAG, IF_MATCH, IF_NONE_MATCH, LOCATION, RETRY_AFTER,
        WWW_AUTHENTICATE,
    },
};
use tower_http::cors::CorsLayer;

use super::{
    rate_limit::{RATE_LIMIT, RATE_LIMIT_POLICY},
    request_id,
};
use crate::{
    api::{
        access::API_KEY,
        routes::{
            detect::{INFERENCE_TIME, PERSON_COUNT, QUEUE_TIME, SERVER_TIMING, TOTAL_TIME},
            results::events::LAST_EVENT_ID,
        },
    },
    open_inference::HEAD_LENGTH,
};

/// Returns the CORS layer for these origins; `None` if there are none.
pub(in crate::api) fn layer(origins: &[String]) -> Option<CorsLayer> {
    let origins = origins.iter();
    // The settings check the origins: each is a valid header value.
    let origins: Vec<_> = origins
        .filter_map(|origin| HeaderValue::from_str(origin).ok())
        .collect();
    if origins.is_empty() {
        return None;
    }
    let head_length = HeaderName::from_static(HEAD_LENGTH);
    let sent: [HeaderName; 8] = [
        AUTHORIZATION,
        API_KEY,
        CONTENT_TYPE,
        IF_MATCH,
        IF_NONE_MATCH,
        LAST_EVENT_ID,
        head_length.clone(),
        request_id::HEADER,
    ];
    let read: [HeaderName; 13] = [
        ETAG,
        LOCATION,
        RATE_LIMIT,
        RATE_LIMIT_POLICY,
        RETRY_AFTER,
        SERVER_TIMING,
        WWW_AUTHENTICATE,
        INFERENCE_TIME,
        PERSON_COUNT,
        QUEUE_TIME,
        TOTAL_TIME,
        head_length,
        request_id::HEADER,
    ];
    let layer = CorsLayer::new()
        .allow_origin(origins)
        .allow_methods([Method::GET, Method::POST, Method::PUT, Method::DELETE])
        .allow_headers(sent)
        .expose_headers(read);
    Some(layer)
}
