//! The sockets that the settings describe.

use std::net::SocketAddr;

use anyhow::Context;
use tokio::net::TcpListener;

use crate::settings::{ServerSettings, variable_of};

/// What the service listens on.
#[derive(Debug)]
pub struct Sockets {
    /// For everything, or everything but metrics.
    pub main: TcpListener,
    /// For metrics and probes alone, if the settings want that.
    pub metrics: Option<TcpListener>,
}

impl Sockets {
    /// Takes the addresses that the settings name.
    ///
    /// # Errors
    /// One sentence that names the setting: an address that is in use or not this machine's.
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
        format!("{key}: cannot listen on {address}: set {variable} to a free address")
    })
}
