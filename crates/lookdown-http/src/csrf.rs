//! CSRF and DNS rebinding protection for servers without API keys. A browser on the server's
//! machine can reach a server that listens only there, and runs web pages of any origin. CORS
//! prevents such a page from reading responses, but not from sending requests: the layer of
//! tower-http refuses those that may make changes. With DNS rebinding, an attacker's host name
//! resolves to this machine, and its page has the same origin as the server. So requests for a
//! public host name are refused unless the settings list it.
//!
//! A server that only its own machine reaches also refuses requests with the usual headers of a
//! proxy, whose clients are on other machines. API keys make these checks unnecessary: browsers do
//! not add them on their own.

use std::{net::IpAddr, sync::Arc};

use axum::{
    extract::{Request, State},
    http::{HeaderMap, HeaderName, Uri, uri::Authority},
    middleware::Next,
    response::{IntoResponse, Response},
};
use tower_http::csrf::{CsrfLayer, ProtectionError};

use crate::{
    host::host_of,
    problem::{Kind, Problem},
};

/// The headers that forwarding proxies usually add (RFC 7239; RFC 9110, section 7.6.3; by
/// convention).
const FORWARDING_HEADERS: [&str; 4] = ["forwarded", "via", "x-forwarded-for", "x-real-ip"];
/// The names that the public DNS does not delegate (RFC 6761, 6762, 8375; the private-use name of
/// ICANN).
const LOCAL_SUFFIXES: [&str; 4] = [".localhost", ".local", ".internal", ".home.arpa"];
/// Largest number of characters of a host name that an error message repeats.
const MAX_SHOWN_CHARS: usize = 128;

/// The origins that may make changes, and the names of a listener without keys.
#[derive(Debug, Clone)]
pub struct AllowedOrigins {
    /// `true` if only clients on the same machine reach the listener.
    pub own_machine_only: bool,
    /// Origins of other web pages that may make changes.
    pub allowed: Arc<[String]>,
    /// Public names of the listener.
    pub hosts: Arc<[String]>,
    /// The remedies.
    pub remedies: Remedies,
}

/// The ends of the sentences about a refused request: what to set.
#[derive(Debug, Clone, Copy)]
pub struct Remedies {
    /// The setting of the keys.
    pub keys: &'static str,
    /// The remedy for an unknown host name.
    pub hosts: &'static str,
    /// The remedy for an unknown origin.
    pub origins: &'static str,
}

impl AllowedOrigins {
    /// Returns true if the host of the request is not refused.
    pub fn admits(&self, request: &Request) -> bool {
        check(request, self).is_ok()
    }
}

/// Returns the layer that refuses requests of other origins which may make changes.
pub fn layer(
    origins: &AllowedOrigins,
) -> CsrfLayer<impl FnMut(ProtectionError) -> Response + Clone + Send + Sync + 'static> {
    let Remedies {
        keys,
        origins: remedy,
        ..
    } = origins.remedies;
    let mut csrf = CsrfLayer::new();
    for origin in &*origins.allowed {
        // An origin that no browser sends matches none.
        csrf = csrf.clone().add_trusted_origin(origin).unwrap_or(csrf);
    }
    csrf.with_rejection_response(move |_: ProtectionError| {
        let detail =
            format!("without keys ({keys}), web pages of other origins may only read: {remedy}");
        Problem::new(Kind::Forbidden, detail).into_response()
    })
}

/// Refuses requests for public host names, and those that a proxy has forwarded.
///
/// # Errors
/// The refusal.
pub async fn require_host(
    State(origins): State<AllowedOrigins>,
    request: Request,
    next: Next,
) -> Result<Response, Problem> {
    check(&request, &origins)?;
    Ok(next.run(request).await)
}

fn check(request: &Request, origins: &AllowedOrigins) -> Result<(), Problem> {
    let forbidden = |detail| Err(Problem::new(Kind::Forbidden, detail));
    let AllowedOrigins {
        own_machine_only,
        allowed,
        hosts,
        remedies,
    } = origins;
    let keys = remedies.keys;
    let headers = request.headers();
    if *own_machine_only && let Some(header) = forwarding_header(headers) {
        return forbidden(format!(
            "without keys ({keys}), this server answers clients on its own machine only, and {header} \
             shows that a proxy passed this request on: set {keys}"
        ));
    }
    // Every browser sends a host, so a client without one is not a browser.
    let host = host_of(request.uri(), headers);
    if let Some(host) = &host
        && !is_private(host.host())
        && !hosts.iter().any(|pattern| matches(pattern, host.host()))
        && !allowed.iter().any(|origin| names(origin, host))
    {
        let (host, remedy) = (shown(host.as_str()), remedies.hosts);
        return forbidden(format!(
            "without keys ({keys}), this server answers to names that no stranger can own, and the \
             owner of {host} can make it resolve to any machine: use an address, or {remedy}"
        ));
    }
    Ok(())
}

/// Returns `true` if a host name is that of a pattern in the settings.
fn matches(pattern: &str, host: &str) -> bool {
    let name = host.trim_end_matches('.').to_ascii_lowercase();
    match pattern.strip_prefix('*') {
        Some(suffix) => name.ends_with(suffix),
        None => name == pattern,
    }
}

/// Returns the first of [`FORWARDING_HEADERS`] that a request has.
fn forwarding_header(headers: &HeaderMap) -> Option<&str> {
    let mut names = headers.keys().map(HeaderName::as_str);
    names.find(|name| FORWARDING_HEADERS.contains(name))
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
/// that is reserved for local networks.
fn is_private(host: &str) -> bool {
    let name = host.trim_end_matches('.').to_ascii_lowercase();
    let address = name.trim_start_matches('[').trim_end_matches(']');
    let is_local = |suffix: &&str| name.ends_with(suffix);
    address.parse::<IpAddr>().is_ok() || !name.contains('.') || LOCAL_SUFFIXES.iter().any(is_local)
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
            "homeassistant.local",
            "lookdown.internal",
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
    fn patterns_match_names_and_those_below_them() {
        assert!(matches("lookdown.example", "Lookdown.Example."));
        assert!(matches("*.example", "a.b.example"));
        assert!(matches("*", "evil.example"));
        for (pattern, host) in [
            ("lookdown.example", "a.lookdown.example"),
            ("*.example", "example"),
            ("*.example", "badexample"),
        ] {
            assert!(!matches(pattern, host), "{pattern} {host}");
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
