//! CSRF and DNS rebinding protection for servers without API keys. A browser on the server's
//! machine can reach a server that listens only there, and runs web pages of any origin. CORS
//! prevents such a page from reading responses, but not from sending requests. With DNS rebinding,
//! an attacker's host name resolves to this machine, and its page has the same origin as the
//! server.
//!
//! So a request that may make changes is refused unless its `Origin` is the server itself or one of
//! the allowed ones. A server that only its own machine reaches also refuses requests for a
//! public host name, and requests that a proxy forwarded: the clients of a proxy are on other
//! machines. API keys make these checks unnecessary: browsers do not add them on their own.

use std::{net::IpAddr, sync::Arc};

use axum::{
    extract::{Request, State},
    http::{HeaderMap, HeaderName, Uri, header::ORIGIN, uri::Authority},
    middleware::Next,
    response::{IntoResponse, Response},
};

use crate::{
    host::host_of,
    problem::{Kind, Problem},
};

/// The headers that forwarding proxies add (RFC 7239; RFC 9110, section 7.6.3; `X-Real-IP` and
/// `X-Forwarded-…` by convention; RFC 8586; the names of some content networks and load balancers).
const FORWARDING_HEADERS: [&str; 9] = [
    "cdn-loop",
    "cf-connecting-ip",
    "forwarded",
    "true-client-ip",
    "via",
    "x-client-ip",
    "x-cluster-client-ip",
    "x-forwarded",
    "x-real-ip",
];
const FORWARDING_PREFIX: &str = "x-forwarded-";
/// Largest number of characters of a header that an error message repeats.
const MAX_SHOWN_CHARS: usize = 128;

/// The origins that may make changes on a listener without keys.
#[derive(Debug, Clone)]
pub struct AllowedOrigins {
    /// `true` if only clients on the same machine reach the listener.
    pub own_machine_only: bool,
    /// Origins of other web pages that may make changes.
    pub allowed: Arc<[String]>,
    /// The names of the settings, for the remedies.
    pub settings: SettingNames,
}

/// The settings that the remedies name.
#[derive(Debug, Clone, Copy)]
pub struct SettingNames {
    /// The setting of the keys.
    pub keys: &'static str,
    /// The end of the sentence about another host or origin: where to add a trusted one.
    pub origins: &'static str,
}

/// Refuses requests of other origins.
pub async fn refuse(
    State(own_pages): State<AllowedOrigins>,
    request: Request,
    next: Next,
) -> Response {
    match check(&request, &own_pages) {
        Ok(()) => next.run(request).await,
        Err(problem) => problem.into_response(),
    }
}

fn check(request: &Request, own_pages: &AllowedOrigins) -> Result<(), Problem> {
    let AllowedOrigins {
        own_machine_only,
        allowed,
        settings: SettingNames { keys, origins },
    } = own_pages;
    if *own_machine_only && let Some(header) = forwarding_header(request.headers()) {
        let detail = format!(
            "without keys ({keys}), this server answers clients on its own machine only, and \
             {header} shows that a proxy passed this request on: set {keys}"
        );
        return Err(Problem::new(Kind::Forbidden, detail));
    }
    // Every browser sends a host, so a client without one is not a browser.
    let host = host_of(request.uri(), request.headers());
    if let Some(host) = &host
        && *own_machine_only
        && !is_private(host.host())
        && !allowed.iter().any(|origin| names(origin, host))
    {
        let host = shown(host.as_str());
        let detail = format!(
            "without keys ({keys}), this server answers on its own machine only, and {host} may be \
             another machine: use localhost, or {origins}"
        );
        return Err(Problem::new(Kind::Forbidden, detail));
    }
    let Some(origin) = request.headers().get(ORIGIN) else {
        return Ok(());
    };
    let origin = origin.to_str().unwrap_or("null");
    let is_own = host.is_some_and(|host| names(origin, &host));
    if request.method().is_safe() || is_own || allowed.iter().any(|allowed| allowed == origin) {
        return Ok(());
    }
    let origin = shown(origin);
    let detail = format!(
        "without keys ({keys}), web pages of other origins may only read, and this request is from \
         a page of {origin}: {origins}"
    );
    Err(Problem::new(Kind::Forbidden, detail))
}

/// Returns the first header that a forwarding proxy adds.
fn forwarding_header(headers: &HeaderMap) -> Option<&str> {
    headers
        .keys()
        .map(HeaderName::as_str)
        .find(|name| name.starts_with(FORWARDING_PREFIX) || FORWARDING_HEADERS.contains(name))
}

/// Returns `true` if an origin has this host.
fn names(origin: &str, host: &Authority) -> bool {
    let Ok(origin) = origin.parse::<Uri>() else {
        return false;
    };
    let usual_port = match origin.scheme_str() {
        Some("http") => 80,
        Some("https") => 443,
        _ => return false,
    };
    let port = |authority: &Authority| authority.port_u16().unwrap_or(usual_port);
    origin.authority().is_some_and(|authority| {
        authority.host().eq_ignore_ascii_case(host.host()) && port(authority) == port(host)
    })
}

/// Returns `true` if an attacker cannot own the name: it is an address, has no dot, or has a suffix
/// that RFC 6761 (section 6.3) reserves for the local machine.
fn is_private(host: &str) -> bool {
    let name = host.trim_end_matches('.').to_ascii_lowercase();
    let address = name.trim_start_matches('[').trim_end_matches(']');
    address.parse::<IpAddr>().is_ok() || !name.contains('.') || name.ends_with(".localhost")
}

fn shown(text: &str) -> String {
    text.chars().take(MAX_SHOWN_CHARS).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_and_names_without_a_dot_are_private() {
        for host in [
            "localhost",
            "LOCALHOST",
            "app.localhost",
            "127.0.0.1",
            "[::1]",
            "camera-pc",
        ] {
            assert!(is_private(host), "{host}");
        }
        for host in [
            "evil.example",
            "localhost.evil.example",
            "127.0.0.1.evil.example",
            "a.b.",
        ] {
            assert!(!is_private(host), "{host}");
        }
    }

    #[test]
    fn an_origin_matches_a_host_with_the_same_name_and_port() {
        let names = |origin: &str, host: &str| names(origin, &host.parse().unwrap());
        assert!(names("http://localhost:8080", "localhost:8080"));
        assert!(names("http://LocalHost", "localhost:80"));
        assert!(names("https://camera.example", "camera.example"));
        assert!(names("http://[::1]:8080", "[::1]:8080"));
        for (origin, host) in [
            ("http://localhost:8081", "localhost:8080"),
            ("http://localhost", "localhost:8080"),
            ("http://evil.example:8080", "localhost:8080"),
            ("null", "localhost:8080"),
            ("file://", "localhost:8080"),
            ("", "localhost"),
        ] {
            assert!(!names(origin, host), "{origin} {host}");
        }
    }
}
