//! The way to the broker: TCP, and TLS on it where the URL says so.

use std::io;

use tokio::{
    io::{AsyncRead, AsyncWrite},
    net::TcpStream,
};

use super::Broker;
use crate::tls::ClientTls;

/// Whatever packets go over.
pub(super) trait Stream: AsyncRead + AsyncWrite + Send + Unpin {}

impl<T: AsyncRead + AsyncWrite + Send + Unpin> Stream for T {}

/// A new connection; `tls` is there when the broker has it.
pub(super) async fn connect(
    broker: &Broker,
    tls: Option<&ClientTls>,
) -> io::Result<Box<dyn Stream>> {
    let stream = TcpStream::connect((broker.host.as_str(), broker.port)).await?;
    // Counts are small, and wanted at once.
    stream.set_nodelay(true)?;
    Ok(match tls {
        Some(tls) => Box::new(tls.connect(&broker.host, stream).await?),
        None => Box::new(stream),
    })
}
