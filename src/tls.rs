//! TLS: the server's certificate and private key, reloaded when their files change, the handshakes,
//! and TLS for outgoing connections.

mod identity;
#[cfg(test)]
mod tests;

use std::{io, num::NonZeroU64, path::Path, sync::Arc};

use jiff::Timestamp;
use lookdown_common::LogOnce;
use lookdown_http::server::Handshake;
use parking_lot::{Mutex, RwLock};
use rustls::{ClientConfig, RootCertStore, ServerConfig, pki_types::ServerName};
use tokio::{
    io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt},
    net::TcpStream,
    time::timeout,
};
use tokio_rustls::{TlsAcceptor, TlsConnector, client, server};

pub use identity::TlsOptions;

use self::identity::{Identity, TlsFiles, authorities_in, damaged};
use crate::metrics::Metrics;

/// The current certificate and private key.
pub struct Tls {
    options: TlsOptions,
    metrics: Arc<Metrics>,
    serving: RwLock<Arc<Identity>>,
    /// The last logged problem of the files. Locked while the files are read.
    problem_log: Mutex<LogOnce>,
}

impl Tls {
    /// Reads the files that `options` names.
    ///
    /// # Errors
    /// If they cannot be used.
    pub fn open(options: TlsOptions, metrics: Arc<Metrics>) -> anyhow::Result<Self> {
        let files = TlsFiles::read(&options)?;
        let identity = Identity::new(&files, &options)?;
        show(&identity, &options, &metrics);
        Ok(Self {
            options,
            metrics,
            serving: RwLock::new(Arc::new(identity)),
            problem_log: Mutex::default(),
        })
    }

    /// Interval between two reads of the files, seconds. `None` disables the reload.
    pub fn poll_seconds(&self) -> Option<NonZeroU64> {
        self.options.poll_seconds
    }

    /// Reads the files again. If they cannot be used, the current certificate stays in use, and the
    /// reason is logged once. Open connections are not affected.
    pub fn refresh(&self) {
        let mut problem_log = self.problem_log.lock();
        match self.newer() {
            Ok(None) => drop(problem_log.clear()),
            Ok(Some(identity)) => {
                problem_log.clear();
                tracing::info!("the TLS certificate has changed: new connections get the new one");
                show(&identity, &self.options, &self.metrics);
                *self.serving.write() = Arc::new(identity);
            }
            Err(error) => {
                let problem = error.to_string();
                if problem_log.should_log(&problem) {
                    tracing::error!("{problem}; the previous certificate stays in use");
                    let loads = &self.metrics.tls_certificate_loads;
                    loads.with_label_values(&["failure"]).inc();
                }
            }
        }
    }

    /// The identity in the files, if it differs from the current one.
    fn newer(&self) -> anyhow::Result<Option<Identity>> {
        let files = TlsFiles::read(&self.options)?;
        if files.digest() == self.serving().digest {
            return Ok(None);
        }
        Identity::new(&files, &self.options).map(Some)
    }

    fn serving(&self) -> Arc<Identity> {
        Arc::clone(&self.serving.read())
    }
}

/// Publishes the current certificate in the metrics, and logs warnings about it.
fn show(identity: &Identity, options: &TlsOptions, metrics: &Metrics) {
    identity.warn(Timestamp::now(), options);
    let loads = &metrics.tls_certificate_loads;
    loads.with_label_values(&["success"]).inc();
    // An alert needs the first failure, too: its counter exists from the start.
    loads.with_label_values(&["failure"]);
    let expiry = &metrics.tls_certificate_expiry;
    match identity.validity {
        Some(validity) => {
            let no_labels: &[&str] = &[];
            let expiry = expiry.with_label_values(no_labels);
            expiry.set(validity.not_after.as_second());
        }
        None => expiry.reset(),
    }
}

impl Handshake for Tls {
    type Stream = server::TlsStream<TcpStream>;

    /// Performs the TLS handshake of a connection. Returns `None` if it fails, is refused, or takes
    /// longer than the handshake timeout.
    async fn accept(&self, connection: TcpStream) -> Option<server::TlsStream<TcpStream>> {
        let config = Arc::clone(&self.serving().config);
        let handshake = shake_hands(connection, config);
        let (result, encrypted) = match timeout(self.options.handshake_timeout, handshake).await {
            Ok(Ok(encrypted)) => ("success", Some(encrypted)),
            Ok(Err(error)) => {
                tracing::debug!("a TLS handshake failed: {error}");
                ("failure", None)
            }
            Err(_) => {
                tracing::debug!("a TLS handshake took too long");
                ("timeout", None)
            }
        };
        let handshakes = &self.metrics.tls_handshakes;
        handshakes.with_label_values(&[result]).inc();
        encrypted
    }
}

/// The first byte of a TLS record that holds a handshake (RFC 8446, section 5.1).
const HANDSHAKE_RECORD: u8 = 22;
/// The response to a plain HTTP request.
const ANSWER_TO_PLAIN_HTTP: &[u8] = b"HTTP/1.1 400 Bad Request\r\n\
    Content-Type: text/plain; charset=utf-8\r\nContent-Length: 63\r\nConnection: close\r\n\r\n\
    This server speaks TLS: ask with https:// instead of http://.\r\n";
/// Most bytes of a plain request that are discarded after the response.
const MAX_IGNORED_BYTES: u64 = 1 << 20;

/// Performs the handshake. A client that sends no TLS gets an HTTP response that says so.
async fn shake_hands(
    mut connection: TcpStream,
    config: Arc<ServerConfig>,
) -> io::Result<server::TlsStream<TcpStream>> {
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
            Some(path) => authorities_in(setting, path)?,
            None => rustls_native_certs::load_native_certs().certs,
        };
        // A certificate that cannot be parsed is not trusted.
        let (_, refused) = roots.add_parsable_certificates(trusted);
        if let Some(path) = authorities.filter(|_| refused > 0) {
            return Err(damaged(setting, path));
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
    ) -> io::Result<client::TlsStream<TcpStream>> {
        let name = ServerName::try_from(host.to_owned()).map_err(io::Error::other)?;
        self.0.connect(name, connection).await
    }
}
