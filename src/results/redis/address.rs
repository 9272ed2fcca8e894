//! The address of a Redis.
//!
//! Opens connections to Redis, with a bound on the time of every reply.
//!
//! A bounded queue of the messages that Redis pushes. A queue that overflows ends, and with it the
//! connection: the next one reads from the streams what it has missed.

use std::{fmt, io, str::FromStr, sync::Arc, time::Duration};

use parking_lot::Mutex;
use redis::{
    AsyncConnectionConfig, Client, ConnectionAddr, ProtocolVersion, PushInfo, PushKind,
    RedisResult, Value, aio::MultiplexedConnection,
};
use tokio::{
    spawn,
    sync::{Notify, OwnedSemaphorePermit, Semaphore, mpsc},
    time::timeout,
};
use url::Url;

use crate::tls::{ClientTls, Stream, connect};

/// The address and the credentials of a Redis. It is displayed without the credentials.
#[derive(Clone)]
pub struct RedisAddress {
    url: Url,
    pub(super) client: Client,
}

/// The text is not an address of a Redis. The text is not repeated, as it may hold a password.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "give redis://host:port/database, or rediss:// for TLS, with user:password@ before \
     the host where a login is needed"
)]
pub struct RedisAddressError;

impl RedisAddress {
    /// The number of the database.
    pub(super) fn database(&self) -> i64 {
        self.client.get_connection_info().redis_settings().db()
    }
}

impl FromStr for RedisAddress {
    type Err = RedisAddressError;

    fn from_str(text: &str) -> Result<Self, RedisAddressError> {
        let url: Url = text.parse().map_err(|_| RedisAddressError)?;
        let is_plain = url.query().is_none() && url.fragment().is_none();
        if !matches!(url.scheme(), "redis" | "rediss") || !is_plain {
            return Err(RedisAddressError);
        }
        let client = Client::open(url.clone()).map_err(|_| RedisAddressError)?;
        Ok(Self { url, client })
    }
}

impl PartialEq for RedisAddress {
    fn eq(&self, other: &Self) -> bool {
        self.url == other.url
    }
}

impl fmt::Display for RedisAddress {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let info = self.client.get_connection_info();
        if let ConnectionAddr::Tcp(_, port) | ConnectionAddr::TcpTls { port, .. } = info.addr() {
            let host = self.url.host_str().unwrap_or_default();
            write!(formatter, "{}://{host}:{port}", self.url.scheme())?;
        }
        write!(formatter, "/{}", self.database())
    }
}

impl fmt::Debug for RedisAddress {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, formatter)
    }
}

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
        let tls = match address.client.get_connection_info().addr() {
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
        let (accept, pushes) = queue();
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
        let login = self.address.client.get_connection_info().redis_settings();
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

    async fn stream(&self) -> io::Result<Box<dyn Stream>> {
        let (ConnectionAddr::Tcp(host, port) | ConnectionAddr::TcpTls { host, port, .. }) =
            self.address.client.get_connection_info().addr()
        else {
            // No address of this kind can be configured.
            return Err(io::ErrorKind::Unsupported.into());
        };
        connect(host, *port, self.tls.as_ref()).await
    }
}

/// Most bytes of the messages that wait, beside those of the largest report.
const MOST_BYTES: usize = 16 << 20;
/// Memory of a message in addition to its payload.
const MESSAGE_BYTES: usize = 1 << 10;

/// A message, and its share of the queue's memory.
type Waiting = (PushInfo, OwnedSemaphorePermit);

/// The receiving end of the queue.
pub(super) struct Pushes {
    messages: mpsc::Receiver<Waiting>,
    ended: Arc<Notify>,
}

/// Creates a queue: a function that accepts messages without waiting, and the receiving end.
pub(super) fn queue() -> (
    impl Fn(PushInfo) -> Result<(), ()> + Send + Sync + 'static,
    Pushes,
) {
    let (sender, messages) = mpsc::channel::<Waiting>(MOST_BYTES / MESSAGE_BYTES);
    let sender = Mutex::new(Some(sender));
    let bytes = Arc::new(Semaphore::new(MOST_BYTES));
    let ended = Arc::new(Notify::new());
    let pushes = Pushes {
        messages,
        ended: Arc::clone(&ended),
    };
    let accept = move |push: PushInfo| {
        let mut sender = sender.lock();
        let is_over = push.kind == PushKind::Disconnection;
        let size = u32::try_from(bytes_of(&push)).unwrap_or(u32::MAX);
        let share = Arc::clone(&bytes).try_acquire_many_owned(size);
        match (&*sender, share) {
            (Some(open), Ok(share)) if !is_over => open.try_send((push, share)).map_err(|_| ()),
            _ => {
                *sender = None;
                ended.notify_one();
                Err(())
            }
        }
    };
    (accept, pushes)
}

impl Pushes {
    /// The end of the connection or of the queue, at once, also while messages wait.
    pub(super) fn ended(&self) -> Arc<Notify> {
        Arc::clone(&self.ended)
    }

    /// Returns the next message. `None` when the connection or the queue has ended.
    pub(super) async fn next(&mut self) -> Option<PushInfo> {
        let (push, _) = self.messages.recv().await?;
        Some(push)
    }

    /// Returns the next message if it has arrived already.
    pub(super) fn waiting(&mut self) -> Option<PushInfo> {
        let (push, _) = self.messages.try_recv().ok()?;
        Some(push)
    }
}

fn bytes_of(push: &PushInfo) -> usize {
    let parts = push.data.iter().map(|part| match part {
        Value::BulkString(bytes) => bytes.len(),
        _ => 0,
    });
    MESSAGE_BYTES + parts.sum::<usize>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_shown_without_its_credentials() {
        for (text, shown) in [
            ("redis://localhost", "redis://localhost:6379/0"),
            ("redis://:s3cret@redis:6380/2", "redis://redis:6380/2"),
            ("rediss://me:s3cret@[::1]/", "rediss://[::1]:6379/0"),
        ] {
            let address: RedisAddress = text.parse().unwrap();
            assert_eq!(address.to_string(), shown);
            assert_eq!(format!("{address:?}"), shown);
        }
    }

    #[test]
    fn other_texts_are_refused_without_being_repeated() {
        for text in [
            "",
            "localhost:6379",
            "http://:s3cret@localhost",
            "redis://:s3cret@localhost/first",
            "redis://:s3cret@",
            "rediss://:s3cret@localhost/#insecure",
            "redis://:s3cret@localhost?protocol=7",
        ] {
            let error = text.parse::<RedisAddress>().unwrap_err();
            assert!(!error.to_string().contains("s3cret"), "{text}");
        }
    }

    fn message(length: usize) -> PushInfo {
        PushInfo {
            kind: PushKind::SMessage,
            data: vec![Value::BulkString(vec![b'x'; length])],
        }
    }

    #[tokio::test]
    async fn messages_are_received_in_order_until_it_overflows() {
        let (accept, mut pushes) = queue();
        for length in 0..1000 {
            accept(message(length)).unwrap();
            assert_eq!(pushes.next().await, Some(message(length)));
        }
        let accepted = (0..MOST_BYTES).take_while(|_| accept(message(9000)).is_ok());
        let accepted = accepted.count();
        assert!((1..=MOST_BYTES / 9000).contains(&accepted), "{accepted}");
        for _ in 0..accepted {
            assert_eq!(pushes.next().await, Some(message(9000)));
        }
        assert_eq!(pushes.next().await, None);
    }

    #[tokio::test]
    async fn a_lost_connection_ends_the_queue() {
        let (accept, mut pushes) = queue();
        accept(message(1)).unwrap();
        let disconnection = PushInfo {
            kind: PushKind::Disconnection,
            data: Vec::new(),
        };
        accept(disconnection).unwrap_err();
        assert!(pushes.next().await.is_some());
        assert!(pushes.next().await.is_none());
    }
}
