//! A question to a running server, asked on its own machine: does it live, is it ready?

use std::{
    net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr},
    time::Duration,
};

use reqwest::{Client, StatusCode, redirect};

use crate::settings::Settings;

/// Longest that the answer may take, the connection included: less than container engines wait.
const PATIENCE: Duration = Duration::from_secs(3);

/// What is asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Probe {
    /// Does the process answer?
    Liveness,
    /// Can frames be sent?
    Readiness,
}

/// Why a server did not say yes.
#[derive(Debug, thiserror::Error)]
pub enum ProbeError {
    /// Nobody but the server knows its port.
    #[error(
        "server.listen: port 0 is a port of the system's choice, which only the log tells: name one"
    )]
    PortOfTheSystem,
    /// The HTTP client cannot be made.
    #[error("no request can be sent")]
    Client(#[source] reqwest::Error),
    /// There was no answer.
    #[error("{url} does not answer: is `lookdown serve` running with these settings?{hint}")]
    Silent {
        /// Where it was asked.
        url: String,
        /// What else may be the matter.
        hint: &'static str,
        /// Why not.
        #[source]
        source: reqwest::Error,
    },
    /// The answer was no.
    #[error("{url} answered {status}: its body and the server's log say why")]
    Refused {
        /// Where it was asked.
        url: String,
        /// The answer.
        status: StatusCode,
    },
}

/// Asks the server with these settings and returns the URL that answered yes. Ends within three
/// seconds.
///
/// # Errors
/// [`ProbeError`] when the answer is no, or there is none.
pub async fn ask(settings: &Settings, probe: Probe) -> Result<String, ProbeError> {
    let url = url(settings, probe)?;
    // Fails when there is one already, which is as good.
    let _ = rustls::crypto::ring::default_provider().install_default();
    let client = Client::builder()
        .timeout(PATIENCE)
        .redirect(redirect::Policy::none())
        .no_proxy()
        // The certificate is for the names that clients use, not for this address. Nothing secret is sent.
        .tls_danger_accept_invalid_certs(true)
        .build()
        .map_err(ProbeError::Client)?;
    match client.get(&url).send().await {
        Ok(answer) if answer.status().is_success() => Ok(url),
        Ok(answer) => Err(ProbeError::Refused {
            url,
            status: answer.status(),
        }),
        Err(error) => Err(ProbeError::Silent {
            url,
            hint: hint(settings),
            source: error.without_url(),
        }),
    }
}

/// Where the server answers probes: on the port of metrics if there is one, as that speaks plain HTTP
/// and asks nobody for a certificate.
fn url(settings: &Settings, probe: Probe) -> Result<String, ProbeError> {
    let (scheme, address) = match (settings.server.metrics_listen, &settings.tls) {
        (Some(address), _) => ("http", address),
        (None, Some(_)) => ("https", settings.server.listen),
        (None, None) => ("http", settings.server.listen),
    };
    if address.port() == 0 {
        return Err(ProbeError::PortOfTheSystem);
    }
    let path = match probe {
        Probe::Liveness => "livez",
        Probe::Readiness => "readyz",
    };
    Ok(format!("{scheme}://{}/{path}", reachable(address)))
}

/// An address to connect to, for one to listen on.
fn reachable(address: SocketAddr) -> SocketAddr {
    let ip = match address.ip() {
        IpAddr::V4(ip) if ip.is_unspecified() => Ipv4Addr::LOCALHOST.into(),
        IpAddr::V6(ip) if ip.is_unspecified() => Ipv6Addr::LOCALHOST.into(),
        ip => ip,
    };
    SocketAddr::new(ip, address.port())
}

/// What else may be the matter with a server that does not answer.
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
