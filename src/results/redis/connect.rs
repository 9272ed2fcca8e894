//! Opens connections to Redis, with a bound on the time of every reply.

use std::{io, time::Duration};

use redis::{
    AsyncConnectionConfig, ConnectionAddr, ProtocolVersion, RedisResult,
    aio::{AsyncStream, MultiplexedConnection},
};
use tokio::{net::TcpStream, spawn, time::timeout};

use super::{
    RedisAddress,
    pushes::{self, Pushes},
};
use crate::tls::ClientTls;

/// Longest time for the login, and for any reply of Redis.
pub(super) const TIMEOUT: Duration = Duration::from_secs(2);
/// Most queries in flight on a connection, which bounds the memory of all replies together.
const MAX_QUERIES: usize = 4;

/// Opens connections to a Redis.
pub(super) struct Connector {
    address: RedisAddress,
    /// Present if the address asks for TLS.
    tls: Option<ClientTls>,
}

impl Connector {
    /// Creates a connector. Sends nothing.
    ///
    /// # Errors
    /// If TLS cannot be used.
    pub(super) fn new(address: RedisAddress) -> anyhow::Result<Self> {
        let tls = match address.client().get_connection_info().addr() {
            ConnectionAddr::TcpTls { .. } => Some(ClientTls::new("results.url", None)?),
            _ => None,
        };
        Ok(Self { address, tls })
    }

    /// Connects and logs in.
    pub(super) async fn connect(&self) -> RedisResult<MultiplexedConnection> {
        self.open(ProtocolVersion::RESP2, AsyncConnectionConfig::new())
            .await
    }

    /// Connects for subscriptions, and logs in.
    pub(super) async fn connect_for_pushes(&self) -> RedisResult<(MultiplexedConnection, Pushes)> {
        let (accept, pushes) = pushes::queue();
        let config = AsyncConnectionConfig::new().set_push_sender(accept);
        let connection = self.open(ProtocolVersion::RESP3, config).await?;
        Ok((connection, pushes))
    }

    async fn open(
        &self,
        protocol: ProtocolVersion,
        config: AsyncConnectionConfig,
    ) -> RedisResult<MultiplexedConnection> {
        let config = config
            .set_response_timeout(Some(TIMEOUT))
            .set_concurrency_limit(MAX_QUERIES);
        let login = self.address.client().get_connection_info().redis_settings();
        let login = login.clone().set_protocol(protocol);
        let opened = async {
            let stream = self.stream().await?;
            MultiplexedConnection::new_with_config(&login, stream, config).await
        };
        let opened = timeout(TIMEOUT, opened).await;
        let (connection, driver) =
            opened.map_err(|_| io::Error::from(io::ErrorKind::TimedOut))??;
        // It ends with the last clone of the connection.
        spawn(driver);
        Ok(connection)
    }

    async fn stream(&self) -> io::Result<Box<dyn AsyncStream + Send + Unpin>> {
        let (ConnectionAddr::Tcp(host, port) | ConnectionAddr::TcpTls { host, port, .. }) =
            self.address.client().get_connection_info().addr()
        else {
            // No address of this kind can be configured.
            return Err(io::ErrorKind::Unsupported.into());
        };
        let stream = TcpStream::connect((host.as_str(), *port)).await?;
        stream.set_nodelay(true)?;
        Ok(match &self.tls {
            Some(tls) => Box::new(tls.connect(host, stream).await?),
            None => Box::new(stream),
        })
    }
}
