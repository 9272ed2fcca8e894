//! The `Host` header: HTTP/1.1 requires exactly one valid value (RFC 9112, section 3.2).
//!
//! The check protects the rules that depend on the host, such as the DNS rebinding protection: an
//! invalid host must not count as a missing one.

use axum::{
    extract::Request,
    http::{HeaderMap, Uri, Version, header::HOST, uri::Authority},
    middleware::Next,
    response::Response,
};

use crate::problem::{Kind, Problem};

/// Refuses HTTP/1.1 requests without exactly one valid `Host`.
///
/// # Errors
/// The refusal.
pub async fn require(request: Request, next: Next) -> Result<Response, Problem> {
    if request.version() == Version::HTTP_11 && only_host(request.headers()).is_none() {
        let detail = "an HTTP/1.1 request needs exactly one Host header with a valid host, such as \
                      localhost:8080 (RFC 9112, section 3.2)";
        return Err(Problem::new(Kind::MalformedRequest, detail));
    }
    Ok(next.run(request).await)
}

/// Returns the host of the request: that of the request target, or else the only `Host` header.
/// HTTP/1.0 requires none.
pub fn host_of(uri: &Uri, headers: &HeaderMap) -> Option<Authority> {
    uri.authority().cloned().or_else(|| only_host(headers))
}

/// Returns the only `Host` header if it is a valid host and port (RFC 3986, section 3.2.2) without
/// user information.
fn only_host(headers: &HeaderMap) -> Option<Authority> {
    let mut values = headers.get_all(HOST).iter();
    let (Some(value), None) = (values.next(), values.next()) else {
        return None;
    };
    let text = value.to_str().ok()?;
    let is_host_character = |c: char| c.is_ascii_alphanumeric() || "-._~!$&'()*+,;=:[]".contains(c);
    let authority: Authority = text.parse().ok()?;
    // The parser accepts text behind the bracket of an address, and any number as a port.
    let rest = text.strip_prefix(authority.host())?;
    let is_port = |port: &str| port.is_empty() || port.parse::<u16>().is_ok();
    let is_valid = !authority.host().is_empty()
        && text.chars().all(is_host_character)
        && (rest.is_empty() || rest.strip_prefix(':').is_some_and(is_port));
    is_valid.then_some(authority)
}

#[cfg(test)]
mod tests {
    use axum::http::HeaderValue;

    use super::*;

    fn is_valid(values: &[&[u8]]) -> bool {
        let mut headers = HeaderMap::new();
        for value in values {
            headers.append(HOST, HeaderValue::from_bytes(value).unwrap());
        }
        only_host(&headers).is_some()
    }

    #[test]
    fn names_and_addresses_with_and_without_port_are_valid() {
        for host in [
            "localhost",
            "localhost:8080",
            "a-b.example",
            "127.0.0.1:1",
            "[::1]:8080",
        ] {
            assert!(is_valid(&[host.as_bytes()]), "{host}");
        }
    }

    #[test]
    fn missing_repeated_and_malformed_hosts_are_invalid() {
        assert!(!is_valid(&[]));
        assert!(!is_valid(&[b"localhost", b"localhost"]));
        for host in [
            &b""[..],
            b":8080",
            b"a{b.evil.example:18081",
            b"a`b",
            b"a\"b",
            b"\xc3\xa4.evil.example",
            b"a%b",
            b"evil.example, localhost",
            b"user@localhost",
            b"localhost/path",
            b"[::1]evil.example",
            b"localhost:65536",
        ] {
            assert!(!is_valid(&[host]), "{}", String::from_utf8_lossy(host));
        }
    }
}
