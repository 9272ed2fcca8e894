//! Request IDs: the client's own if it is valid, otherwise a generated one.

use axum::http::{HeaderMap, HeaderName, HeaderValue};
use uuid::Uuid;

/// The header of the ID, in requests and responses.
pub const HEADER: HeaderName = HeaderName::from_static("x-request-id");
const MAX_CHARS: usize = 128;

/// Identifies a request in logs, reports and problems: 1 to 128 visible ASCII characters.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RequestId(String);

impl RequestId {
    /// Returns the ID of the request with these headers.
    pub fn from_headers(headers: &HeaderMap) -> Self {
        let given = headers.get(HEADER).and_then(|value| value.to_str().ok());
        match given {
            Some(id) if is_sane(id) => Self(id.to_owned()),
            _ => Self(Uuid::now_v7().to_string()),
        }
    }

    /// Returns the ID as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Returns the ID as the value of the header.
    pub fn header_value(&self) -> HeaderValue {
        // Visible ASCII is always a header value.
        HeaderValue::from_str(&self.0).unwrap_or(HeaderValue::from_static("invalid"))
    }
}

fn is_sane(id: &str) -> bool {
    (1..=MAX_CHARS).contains(&id.len()) && id.chars().all(|c| c.is_ascii_graphic())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn id_for(given: &'static str) -> RequestId {
        let mut headers = HeaderMap::new();
        headers.insert(HEADER, HeaderValue::from_static(given));
        RequestId::from_headers(&headers)
    }

    #[test]
    fn a_valid_id_is_kept_and_any_other_is_replaced() {
        assert_eq!(id_for("camera-7/0001").as_str(), "camera-7/0001");
        let long: &'static str = Box::leak("x".repeat(129).into_boxed_str());
        for insane in ["", "two words", "tab\there", long] {
            let id = id_for(insane);
            assert_eq!(Uuid::parse_str(id.as_str()).unwrap().get_version_num(), 7);
        }
    }

    #[test]
    fn a_request_without_an_id_gets_a_new_one() {
        let none = HeaderMap::new();
        assert_ne!(
            RequestId::from_headers(&none),
            RequestId::from_headers(&none)
        );
    }
}
