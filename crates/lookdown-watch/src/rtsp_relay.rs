//! A relay between `ffmpeg` and an RTSP camera.
//!
//! `ffmpeg` follows redirections to any host, takes the password along, and sends it in plain text
//! to any host that asks. So it gets a URL on the loopback interface without credentials. The relay
//! alone connects to the camera, answers its challenges, and ends at a redirection.
//!
//! TLS to a camera. Its certificate is not checked, as cameras sign theirs themselves: TLS conceals
//! the stream from listeners only.

mod exchange;
mod message;

use std::{io, net::IpAddr, sync::Arc, time::Duration};

use bytes::BytesMut;
use reqwest::Url;
use rustls::{
    ClientConfig, DigitallySignedStruct, SignatureScheme,
    client::danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier},
    crypto::{CryptoProvider, verify_tls12_signature, verify_tls13_signature},
    pki_types::{CertificateDer, ServerName, UnixTime},
};
use tokio::{
    io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt},
    net::{TcpListener, TcpStream},
    time::{sleep, timeout},
};
use tokio_rustls::{TlsConnector, client::TlsStream};

use crate::{SourceError, credentials::Login};

use exchange::Exchange;
use message::{Unit, next_unit};

/// The ports of `rtsp` and `rtsps`.
const PORTS: (u16, u16) = (554, 322);
/// Bytes that are read at once.
const CHUNK_BYTES: usize = 64 << 10;
/// Longest time for the first request of a connection to the relay.
const FIRST_REQUEST: Duration = Duration::from_secs(5);
/// Longest time for another connection to the camera.
const RECONNECT: Duration = Duration::from_secs(5);
/// Pause after the system has refused a connection, for example for lack of file descriptors.
const PAUSE: Duration = Duration::from_millis(100);
/// Random bytes of the token in the URL of the relay.
const TOKEN_BYTES: usize = 16;

/// A connection to a camera, in plain text or with TLS.
trait Connection: AsyncRead + AsyncWrite + Send + Unpin {}
impl<T: AsyncRead + AsyncWrite + Send + Unpin> Connection for T {}

/// A relay that is connected to a camera, and waits for `ffmpeg`.
pub(crate) struct Relay {
    camera: Box<dyn Connection>,
    peer: IpAddr,
    listener: TcpListener,
    inner: String,
    /// The URL of the camera without credentials.
    url: Url,
}

impl Relay {
    /// Connects to a camera within a time limit.
    ///
    /// # Errors
    /// [`SourceError::Unreachable`].
    pub(crate) async fn connect(url: &Url, limit: Duration) -> Result<Self, SourceError> {
        let unreachable = |problem: String| SourceError::Unreachable(problem);
        let connected = timeout(limit, connect(url)).await;
        let connected =
            connected.map_err(|_| unreachable(format!("no answer within {limit:?}")))?;
        let (camera, peer) = connected.map_err(|error| unreachable(error.to_string()))?;
        let local = async {
            let listener = TcpListener::bind(("127.0.0.1", 0)).await?;
            let port = listener.local_addr()?.port();
            let mut token = [0; TOKEN_BYTES];
            getrandom::fill(&mut token).map_err(std::io::Error::other)?;
            let token = u128::from_be_bytes(token);
            // Only `ffmpeg` has the token, so no other local process gets the stream.
            std::io::Result::Ok((listener, format!("rtsp://127.0.0.1:{port}/{token:032x}")))
        };
        let (listener, inner) = local
            .await
            .map_err(|error| unreachable(error.to_string()))?;
        Ok(Self {
            camera,
            peer,
            listener,
            inner,
            url: url.clone(),
        })
    }

    /// The URL for `ffmpeg`.
    pub(crate) fn url(&self) -> &str {
        &self.inner
    }

    /// Relays one connection. Ends with an error that concerns the camera, otherwise never: the end
    /// of a connection ends `ffmpeg`, which reports it.
    pub(crate) async fn run(self, login: &mut Login) -> SourceError {
        let Self {
            mut camera,
            peer,
            listener,
            inner,
            url,
        } = self;
        let (mut ffmpeg, mut from_ffmpeg) = accept(&listener, &inner).await;
        drop(listener);
        let mut exchange = Exchange::new(inner, url.as_str().to_owned(), peer, login);
        let mut from_camera = BytesMut::new();
        let mut to_camera = BytesMut::new();
        let mut reconnected = false;
        let relay = async {
            loop {
                let mut to_ffmpeg = BytesMut::new();
                while let Some(unit) = next_unit(&mut from_ffmpeg)? {
                    match unit {
                        Unit::Packet(packet) => to_camera.extend_from_slice(&packet),
                        Unit::Message(message) => {
                            exchange.accept_request(message, &mut to_camera)?;
                        }
                    }
                }
                while let Some(unit) = next_unit(&mut from_camera)? {
                    match unit {
                        Unit::Packet(packet) => to_ffmpeg.extend_from_slice(&packet),
                        Unit::Message(message) => {
                            exchange.accept_answer(message, &mut to_ffmpeg, &mut to_camera)?;
                        }
                    }
                }
                let sent = async {
                    camera.write_all(&to_camera).await?;
                    camera.flush().await
                };
                let is_sent = sent.await.is_ok();
                to_camera.clear();
                if ffmpeg.write_all(&to_ffmpeg).await.is_err() {
                    return Ok(());
                }
                from_camera.reserve(CHUNK_BYTES);
                from_ffmpeg.reserve(CHUNK_BYTES);
                let is_open = is_sent
                    && tokio::select! {
                        read = camera.read_buf(&mut from_camera) => read.unwrap_or(0) > 0,
                        read = ffmpeg.read_buf(&mut from_ffmpeg) => {
                            if read.unwrap_or(0) == 0 {
                                return Ok(());
                            }
                            true
                        }
                    };
                if is_open {
                    continue;
                }
                // Some cameras close the connection of a 401: the answer goes through another one.
                if !exchange.awaits_login() {
                    return Ok(());
                }
                if std::mem::replace(&mut reconnected, true) {
                    return Err(SourceError::ClosedAfterChallenge);
                }
                let connected = timeout(RECONNECT, connect(&url)).await;
                let Ok(Ok((connection, peer))) = connected else {
                    return Err(SourceError::ClosedAfterChallenge);
                };
                camera = connection;
                exchange.peer = peer;
                from_camera.clear();
                exchange.send_again(&mut to_camera);
            }
        };
        let ended: Result<(), SourceError> = relay.await;
        drop(ffmpeg);
        match ended {
            Err(error) => error,
            Ok(()) => std::future::pending().await,
        }
    }
}

async fn connect(url: &Url) -> std::io::Result<(Box<dyn Connection>, IpAddr)> {
    let host = url.host_str().unwrap_or_default();
    let host = host.trim_matches(['[', ']']);
    let has_tls = url.scheme() == "rtsps";
    let port = url
        .port()
        .unwrap_or(if has_tls { PORTS.1 } else { PORTS.0 });
    let connection = TcpStream::connect((host, port)).await?;
    connection.set_nodelay(true)?;
    let peer = connection.peer_addr()?.ip();
    Ok(if has_tls {
        (Box::new(connect_tls(host, connection).await?), peer)
    } else {
        (Box::new(connection), peer)
    })
}

/// Waits for the connection whose first request has the URL of the relay. Returns it with the bytes
/// that were read.
async fn accept(listener: &TcpListener, inner: &str) -> (TcpStream, BytesMut) {
    loop {
        let Ok((mut connection, _)) = listener.accept().await else {
            sleep(PAUSE).await;
            continue;
        };
        let first = timeout(FIRST_REQUEST, first_line(&mut connection));
        if let Ok(Some(read)) = first.await {
            let line = String::from_utf8_lossy(&read);
            let address = line.split(' ').nth(1);
            if address.is_some_and(|address| address.starts_with(inner)) {
                return (connection, read);
            }
        }
    }
}

/// Reads until the end of the first line.
async fn first_line(connection: &mut TcpStream) -> Option<BytesMut> {
    let mut read = BytesMut::with_capacity(CHUNK_BYTES);
    while !read.contains(&b'\n') {
        if read.len() >= CHUNK_BYTES || connection.read_buf(&mut read).await.ok()? == 0 {
            return None;
        }
    }
    Some(read)
}

/// Performs the handshake.
async fn connect_tls(host: &str, connection: TcpStream) -> io::Result<TlsStream<TcpStream>> {
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let verifier = Arc::new(AnyCertificate(Arc::clone(&provider)));
    let config = ClientConfig::builder_with_provider(provider)
        .with_safe_default_protocol_versions()
        .map_err(io::Error::other)?
        .dangerous()
        .with_custom_certificate_verifier(verifier)
        .with_no_client_auth();
    let name = ServerName::try_from(host.to_owned()).map_err(io::Error::other)?;
    TlsConnector::from(Arc::new(config))
        .connect(name, connection)
        .await
}

/// Accepts every certificate, and checks that the camera has its private key.
#[derive(Debug)]
struct AnyCertificate(Arc<CryptoProvider>);

impl ServerCertVerifier for AnyCertificate {
    fn verify_server_cert(
        &self,
        _: &CertificateDer<'_>,
        _: &[CertificateDer<'_>],
        _: &ServerName<'_>,
        _: &[u8],
        _: UnixTime,
    ) -> Result<ServerCertVerified, rustls::Error> {
        Ok(ServerCertVerified::assertion())
    }

    fn verify_tls12_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signature: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, rustls::Error> {
        let algorithms = &self.0.signature_verification_algorithms;
        verify_tls12_signature(message, certificate, signature, algorithms)
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signature: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, rustls::Error> {
        let algorithms = &self.0.signature_verification_algorithms;
        verify_tls13_signature(message, certificate, signature, algorithms)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        self.0.signature_verification_algorithms.supported_schemes()
    }
}

#[cfg(test)]
mod tests;
