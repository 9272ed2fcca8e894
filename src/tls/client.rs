//! TLS for outgoing connections.

use std::{io, path::Path, sync::Arc};

use rustls::{ClientConfig, RootCertStore, pki_types::ServerName};
use tokio::{
    io::{AsyncRead, AsyncWrite},
    net::TcpStream,
};
use tokio_rustls::{TlsConnector, client::TlsStream};

use super::files;

/// A byte stream to a server.
pub trait Stream: AsyncRead + AsyncWrite + Send + Unpin {}

impl<T: AsyncRead + AsyncWrite + Send + Unpin> Stream for T {}

/// Opens a connection whose small messages arrive without delay; with `tls` if the server uses TLS.
///
/// # Errors
/// If the server cannot be reached, or its certificate is not valid for this host.
pub async fn connect(
    host: &str,
    port: u16,
    tls: Option<&ClientTls>,
) -> io::Result<Box<dyn Stream>> {
    let stream = TcpStream::connect((host, port)).await?;
    stream.set_nodelay(true)?;
    Ok(match tls {
        Some(tls) => Box::new(tls.connect(host, stream).await?),
        None => Box::new(stream),
    })
}

/// The authorities that outgoing connections trust.
#[derive(Clone)]
pub struct ClientTls(TlsConnector);

impl ClientTls {
    /// Trusts the authorities in a PEM file, which the setting `setting` names, or those of the
    /// system.
    ///
    /// # Errors
    /// If the file cannot be used.
    pub fn new(setting: &'static str, authorities: Option<&Path>) -> anyhow::Result<Self> {
        let mut roots = RootCertStore::empty();
        let trusted = match authorities {
            Some(path) => files::authorities(setting, path)?,
            None => rustls_native_certs::load_native_certs().certs,
        };
        // A certificate that cannot be parsed is not trusted.
        let (_, refused) = roots.add_parsable_certificates(trusted);
        if let Some(path) = authorities.filter(|_| refused > 0) {
            return Err(files::damaged(setting, path));
        }
        let provider = Arc::new(rustls::crypto::ring::default_provider());
        let config = ClientConfig::builder_with_provider(provider)
            .with_safe_default_protocol_versions()?
            .with_root_certificates(roots)
            .with_no_client_auth();
        Ok(Self(TlsConnector::from(Arc::new(config))))
    }

    /// Performs the handshake with the server `host`, a name or an address.
    ///
    /// # Errors
    /// If the server's certificate is not valid for this host, or the connection fails.
    pub async fn connect(
        &self,
        host: &str,
        connection: TcpStream,
    ) -> io::Result<TlsStream<TcpStream>> {
        let name = ServerName::try_from(host.to_owned()).map_err(io::Error::other)?;
        self.0.connect(name, connection).await
    }
}
