//! Request IDs: the client's own if it is valid, otherwise a generated one.

use std::time::{SystemTime, UNIX_EPOCH};

use axum::http::{HeaderMap, HeaderName, HeaderValue};
use uuid::{NoContext, Timestamp, Uuid};

/// The header of the ID, in requests and responses.
pub const HEADER: HeaderName = HeaderName::from_static("x-request-id");

/// Identifies a request in logs, reports and problems: 1 to 128 visible ASCII characters.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RequestId(String);

impl RequestId {
    /// Returns the ID of the request with these headers.
    pub fn from_headers(headers: &HeaderMap) -> Self {
        let given = headers.get(HEADER).and_then(|value| value.to_str().ok());
        let is_sane =
            |id: &&str| (1..=128).contains(&id.len()) && id.chars().all(|c| c.is_ascii_graphic());
        let new = || new_id().to_string();
        Self(given.filter(is_sane).map_or_else(new, str::to_owned))
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

/// Returns a new ID that begins with the time, which is 1970 where the clock is before it.
pub fn new_id() -> Uuid {
    id_at(SystemTime::now())
}

fn id_at(now: SystemTime) -> Uuid {
    let since = now.duration_since(UNIX_EPOCH).unwrap_or_default();
    let time = Timestamp::from_unix(NoContext, since.as_secs(), since.subsec_nanos());
    Uuid::new_v7(time)
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
    fn a_clock_before_1970_makes_ids() {
        let before = UNIX_EPOCH - std::time::Duration::from_hours(1);
        assert_ne!(id_at(before), id_at(before));
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
