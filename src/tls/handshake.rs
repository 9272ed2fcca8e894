//! The TLS handshake of an accepted connection.

use std::{io, sync::Arc};

use rustls::ServerConfig;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::TcpStream,
};
use tokio_rustls::{TlsAcceptor, server::TlsStream};

/// The first byte of a TLS record that holds a handshake (RFC 8446, section 5.1).
const HANDSHAKE_RECORD: u8 = 22;
/// The response to a plain HTTP request.
const ANSWER_TO_PLAIN_HTTP: &[u8] = b"HTTP/1.1 400 Bad Request\r\n\
    Content-Type: text/plain; charset=utf-8\r\nContent-Length: 63\r\nConnection: close\r\n\r\n\
    This server speaks TLS: ask with https:// instead of http://.\r\n";
/// Most bytes of a plain request that are discarded after the response.
const MAX_IGNORED_BYTES: u64 = 1 << 20;

/// Performs the handshake. A client that sends no TLS gets an HTTP response that says so.
pub(super) async fn shake_hands(
    mut connection: TcpStream,
    config: Arc<ServerConfig>,
) -> io::Result<TlsStream<TcpStream>> {
    let mut first = [0];
    let read = connection.peek(&mut first).await?;
    if read == 0 {
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    if first != [HANDSHAKE_RECORD] {
        connection.write_all(ANSWER_TO_PLAIN_HTTP).await?;
        connection.shutdown().await?;
        // A close with unread bytes would reset the connection and lose the response.
        let mut rest = connection.take(MAX_IGNORED_BYTES);
        tokio::io::copy(&mut rest, &mut tokio::io::sink()).await?;
        return Err(io::Error::other("its first byte is not TLS"));
    }
    TlsAcceptor::from(config).accept(connection).await
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_response_to_plain_http_states_its_length() {
        let answer = std::str::from_utf8(ANSWER_TO_PLAIN_HTTP).unwrap();
        let (head, body) = answer.split_once("\r\n\r\n").unwrap();
        assert!(
            head.contains(&format!("Content-Length: {}\r\n", body.len())),
            "{}",
            body.len()
        );
    }
}
