//! Opens connections to Redis, with bounds on the time and the size of every reply.

use std::{io, time::Duration};

use redis::{
    AsyncConnectionConfig, ConnectionAddr, RedisResult,
    aio::{AsyncStream, MultiplexedConnection},
};
use tokio::{net::TcpStream, spawn, time::timeout};

use super::{RedisAddress, reply_limit::BoundedReplies};
use crate::tls::{ClientTls, TlsError};

/// Longest time for the login, and for any reply of Redis.
pub(super) const TIMEOUT: Duration = Duration::from_secs(2);
/// Most queries in flight on a connection, which bounds the memory of all replies together.
const MAX_QUERIES: usize = 4;

/// Opens connections to one Redis.
pub(super) struct Connector {
    address: RedisAddress,
    /// Present if the address asks for TLS.
    tls: Option<ClientTls>,
    max_reply_bytes: u64,
}

impl Connector {
    /// Creates a connector. Sends nothing.
    ///
    /// # Errors
    /// [`TlsError`] if TLS cannot be used.
    pub(super) fn new(address: RedisAddress, max_reply_bytes: u64) -> Result<Self, TlsError> {
        let tls = match address.client().get_connection_info().addr() {
            ConnectionAddr::TcpTls { .. } => Some(ClientTls::new("results.url", None)?),
            _ => None,
        };
        Ok(Self {
            address,
            tls,
            max_reply_bytes,
        })
    }

    /// Connects and logs in. A reply may take `patience`.
    pub(super) async fn connect(&self, patience: Duration) -> RedisResult<MultiplexedConnection> {
        let config = AsyncConnectionConfig::new()
            .set_response_timeout(Some(patience))
            .set_concurrency_limit(MAX_QUERIES);
        let login = self.address.client().get_connection_info().redis_settings();
        let opened = async {
            let replies = BoundedReplies::new(self.stream().await?, self.max_reply_bytes);
            MultiplexedConnection::new_with_config(login, replies, config).await
        };
        let opened = timeout(TIMEOUT, opened).await;
        let (connection, driver) =
            opened.map_err(|_| io::Error::from(io::ErrorKind::TimedOut))??;
        // It ends with the last clone of the connection.
        spawn(driver);
        Ok(connection)
    }

    async fn stream(&self) -> io::Result<Box<dyn AsyncStream + Send + Unpin>> {
        let (host, port) = match self.address.client().get_connection_info().addr() {
            ConnectionAddr::Tcp(host, port) | ConnectionAddr::TcpTls { host, port, .. } => {
                (host.as_str(), *port)
            }
            // No address of this kind can be configured.
            _ => return Err(io::Error::from(io::ErrorKind::Unsupported)),
        };
        let stream = TcpStream::connect((host, port)).await?;
        stream.set_nodelay(true)?;
        Ok(match &self.tls {
            Some(tls) => Box::new(tls.connect(host, stream).await?),
            None => Box::new(stream),
        })
    }
}
