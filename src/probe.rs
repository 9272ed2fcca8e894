//! Health checks of a running server on the same machine: liveness and readiness.

use std::{
    net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr},
    time::Duration,
};

use anyhow::{Context, bail, ensure};
use reqwest::{Client, redirect};

use crate::settings::Settings;

/// Longest time for the answer, including the connection: shorter than the timeouts of container
/// engines.
const TIMEOUT: Duration = Duration::from_secs(3);

/// The kind of health check.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Probe {
    /// The process answers.
    Liveness,
    /// The server accepts frames.
    Readiness,
}

/// Checks the server with these settings. Returns the URL that answered 200. Ends within three
/// seconds.
///
/// # Errors
/// If the answer is no, or there is none.
pub async fn ask(settings: &Settings, probe: Probe) -> anyhow::Result<String> {
    let url = url(settings, probe)?;
    // Fails when there is one already, which is as good.
    let _ = rustls::crypto::ring::default_provider().install_default();
    let client = Client::builder()
        .timeout(TIMEOUT)
        .redirect(redirect::Policy::none())
        .no_proxy()
        // The certificate is for the names that clients use, not for this address. Nothing secret
        // is sent.
        .tls_danger_accept_invalid_certs(true)
        .build()
        .context("the HTTP client cannot be created")?;
    let answer = client
        .get(&url)
        .send()
        .await
        .map_err(reqwest::Error::without_url);
    let hint = hint(settings);
    let status = answer
        .with_context(|| {
            format!("{url} does not answer: is `lookdown serve` running with these settings?{hint}")
        })?
        .status();
    ensure!(
        status.is_success(),
        "{url} answered {status}: see its body and the server's log"
    );
    Ok(url)
}

/// Returns the URL of a probe: on the metrics port if there is one, because that port speaks plain
/// HTTP and requests no client certificate.
fn url(settings: &Settings, probe: Probe) -> anyhow::Result<String> {
    let (scheme, address) = match (settings.server.metrics_listen, &settings.tls) {
        (Some(address), _) => ("http", address),
        (None, Some(_)) => ("https", settings.server.listen),
        (None, None) => ("http", settings.server.listen),
    };
    if address.port() == 0 {
        bail!(
            "server.listen: with port 0 the system chooses the port: set a fixed port for health \
             checks"
        );
    }
    let path = match probe {
        Probe::Liveness => "livez",
        Probe::Readiness => "readyz",
    };
    Ok(format!("{scheme}://{}/{path}", reachable(address)))
}

/// The address to connect to for a listening address.
pub(crate) fn reachable(address: SocketAddr) -> SocketAddr {
    let ip = match address.ip() {
        IpAddr::V4(ip) if ip.is_unspecified() => Ipv4Addr::LOCALHOST.into(),
        IpAddr::V6(ip) if ip.is_unspecified() => Ipv6Addr::LOCALHOST.into(),
        ip => ip,
    };
    SocketAddr::new(ip, address.port())
}

/// Returns a further cause why a server may not answer.
fn hint(settings: &Settings) -> &'static str {
    let asks_for_certificates = settings
        .tls
        .as_ref()
        .is_some_and(|tls| tls.client_certificates.is_some());
    if asks_for_certificates && settings.server.metrics_listen.is_none() {
        " It asks for certificates of clients: set server.metrics_listen, where probes need none"
    } else {
        ""
    }
}

#[cfg(test)]
mod tests;
