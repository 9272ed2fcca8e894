//! The whole server over TLS.

use std::{fs, sync::Arc};

use rustls::{
    ClientConfig, RootCertStore,
    crypto::ring,
    pki_types::{CertificateDer, ServerName},
};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::TcpStream,
};
use tokio_rustls::{TlsConnector, client::TlsStream};

use crate::server::Server;

const ASK: &[u8] = b"GET /livez HTTP/1.1\r\nHost: lookdown\r\n\r\n";

/// A client that trusts only this certificate.
async fn connect(server: &Server, certificate: &CertificateDer<'static>) -> TlsStream<TcpStream> {
    let mut roots = RootCertStore::empty();
    roots.add(certificate.clone()).unwrap();
    let config = ClientConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_safe_default_protocol_versions()
        .unwrap()
        .with_root_certificates(roots)
        .with_no_client_auth();
    let connection = TcpStream::connect(server.address).await.unwrap();
    let name = ServerName::try_from("localhost").unwrap();
    let connector = TlsConnector::from(Arc::new(config));
    connector.connect(name, connection).await.unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn all_routes_use_tls_and_the_metrics_port_does_not() {
    let folder = tempfile::tempdir().unwrap();
    let pair = rcgen::generate_simple_self_signed(["localhost".to_owned()]).unwrap();
    let certificate = folder.path().join("server.pem");
    fs::write(
        &certificate,
        pair.cert.pem() + &pair.signing_key.serialize_pem(),
    )
    .unwrap();
    let path: &'static str = certificate.to_str().unwrap().to_owned().leak();
    let server = Server::start(&[
        ("SERVER__TLS__CERTIFICATE", path),
        ("SERVER__TLS__PRIVATE_KEY", path),
        ("SERVER__METRICS_LISTEN", "127.0.0.1:0"),
    ])
    .await;

    let mut connection = connect(&server, pair.cert.der()).await;
    connection.write_all(ASK).await.unwrap();
    let mut answer = vec![0; 15];
    connection.read_exact(&mut answer).await.unwrap();
    assert_eq!(answer, b"HTTP/1.1 200 OK");
    server.shows("connections", 1).await;
    assert!(server.get("/livez").await.starts_with("HTTP/1.1 400 "));

    server.shutdown.request();
    // This fails without a close_notify alert, which protects against truncation.
    connection.read_to_end(&mut answer).await.unwrap();
    server.has_ended().await;
}
