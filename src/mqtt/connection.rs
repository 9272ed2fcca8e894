//! The connection to the broker: TCP, with TLS if the URL asks for it.

use std::io;

use tokio::{
    io::{AsyncRead, AsyncWrite},
    net::TcpStream,
};

use super::Broker;
use crate::tls::ClientTls;

/// A byte stream that carries MQTT packets.
pub(super) trait Stream: AsyncRead + AsyncWrite + Send + Unpin {}

impl<T: AsyncRead + AsyncWrite + Send + Unpin> Stream for T {}

/// Opens a connection. `tls` is given if the broker uses TLS.
pub(super) async fn connect(
    broker: &Broker,
    tls: Option<&ClientTls>,
) -> io::Result<Box<dyn Stream>> {
    let stream = TcpStream::connect((broker.host.as_str(), broker.port)).await?;
    // Counts are small and should arrive without delay.
    stream.set_nodelay(true)?;
    Ok(match tls {
        Some(tls) => Box::new(tls.connect(&broker.host, stream).await?),
        None => Box::new(stream),
    })
}
