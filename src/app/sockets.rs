//! The sockets that the settings describe.

use std::net::SocketAddr;

use anyhow::Context;
use tokio::net::TcpListener;

use crate::settings::{ServerSettings, variable_of};

/// The sockets of the service.
#[derive(Debug)]
pub struct Sockets {
    /// All endpoints, or all except metrics.
    pub main: TcpListener,
    /// Metrics and probes only, if the settings ask for a separate port.
    pub metrics: Option<TcpListener>,
}

impl Sockets {
    /// Binds the addresses of the settings.
    ///
    /// # Errors
    /// One sentence that names the setting, for an address that is in use or not one of this
    /// machine.
    pub async fn bind(settings: &ServerSettings) -> anyhow::Result<Self> {
        let main = bind("server.listen", settings.listen).await?;
        let metrics = match settings.metrics_listen {
            Some(address) => Some(bind("server.metrics_listen", address).await?),
            None => None,
        };
        Ok(Self { main, metrics })
    }
}

async fn bind(key: &str, address: SocketAddr) -> anyhow::Result<TcpListener> {
    TcpListener::bind(address).await.with_context(|| {
        let variable = variable_of(key);
        format!("{key}: cannot listen on {address}: set {variable} or --listen to a free address")
    })
}
