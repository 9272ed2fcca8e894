//! A client that trusts one authority, and an echo server.

use std::{io, net::SocketAddr, sync::Arc};

use lookdown_http::server::Handshake;
use rustls::{
    ClientConfig, RootCertStore, SupportedProtocolVersion,
    crypto::ring,
    pki_types::{CertificateDer, PrivateKeyDer, ServerName, pem::PemObject},
    version::{TLS12, TLS13},
};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::{TcpListener, TcpStream},
};
use tokio_rustls::{TlsConnector, client::TlsStream};

use super::{
    super::Tls,
    certificates::{Authority, Pair},
};

pub(super) const BOTH: &[&SupportedProtocolVersion] = &[&TLS13, &TLS12];

/// Accepts connections and echoes what they send.
pub(super) async fn echo(tls: &Arc<Tls>) -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let tls = Arc::clone(tls);
    tokio::spawn(async move {
        loop {
            let (connection, _) = listener.accept().await.unwrap();
            let tls = Arc::clone(&tls);
            tokio::spawn(async move {
                let encrypted = tls.accept(connection).await?;
                let (mut reader, mut writer) = tokio::io::split(encrypted);
                tokio::io::copy(&mut reader, &mut writer).await.ok()
            });
        }
    });
    address
}

/// A client.
pub(super) struct Client {
    config: ClientConfig,
}

impl Client {
    pub(super) fn new(
        authority: &Authority,
        shown: Option<&Pair>,
        versions: &[&'static SupportedProtocolVersion],
    ) -> Self {
        let mut roots = RootCertStore::empty();
        let root = CertificateDer::from_pem_slice(authority.pem().as_bytes()).unwrap();
        roots.add(root).unwrap();
        let builder = ClientConfig::builder_with_provider(Arc::new(ring::default_provider()))
            .with_protocol_versions(versions)
            .unwrap()
            .with_root_certificates(roots);
        let mut config = match shown {
            None => builder.with_no_client_auth(),
            Some(Pair {
                certificate,
                private_key,
            }) => {
                let chain = CertificateDer::from_pem_slice(certificate.as_bytes()).unwrap();
                let key = PrivateKeyDer::from_pem_slice(private_key.as_bytes()).unwrap();
                builder.with_client_auth_cert(vec![chain], key).unwrap()
            }
        };
        config.alpn_protocols = vec![b"h2".to_vec(), b"http/1.1".to_vec()];
        Self { config }
    }

    pub(super) async fn connect(&self, address: SocketAddr) -> io::Result<TlsStream<TcpStream>> {
        let connection = TcpStream::connect(address).await?;
        let name = ServerName::try_from("localhost").unwrap();
        let connector = TlsConnector::from(Arc::new(self.config.clone()));
        connector.connect(name, connection).await
    }

    /// Connects and exchanges a few bytes. Only then it is known if the server accepts the client's
    /// certificate.
    pub(super) async fn talk(&self, address: SocketAddr) -> io::Result<TlsStream<TcpStream>> {
        let mut connection = self.connect(address).await?;
        exchange(&mut connection).await?;
        Ok(connection)
    }
}

pub(super) async fn exchange(connection: &mut TlsStream<TcpStream>) -> io::Result<()> {
    connection.write_all(b"ping").await?;
    let mut answer = [0; 4];
    connection.read_exact(&mut answer).await?;
    assert_eq!(&answer, b"ping");
    Ok(())
}

/// The certificate of the server, DER.
pub(super) fn shown(connection: &TlsStream<TcpStream>) -> Vec<u8> {
    let chain = connection.get_ref().1.peer_certificates().unwrap();
    chain[0].to_vec()
}
