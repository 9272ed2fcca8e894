//! Handshakes over real sockets, and files that change.

use std::{fs, os::unix::fs::symlink, time::Duration};

use rustls::{
    ProtocolVersion,
    pki_types::{CertificateDer, pem::PemObject},
    version::{TLS12, TLS13},
};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::TcpStream,
};

use super::*;

use certificates::{Authority, Files, Pair, let_read};
use client::{BOTH, Client, echo, exchange, shown};
use log::logged_by;

mod certificates;
mod client;
mod log;

fn open(files: &Files) -> Arc<Tls> {
    Arc::new(Tls::open(files.options.clone(), Arc::default()).unwrap())
}

/// The error of files that are refused at the start: one line without any of the private key.
fn refusal(files: &Files) -> String {
    let refused = Tls::open(files.options.clone(), Arc::default()).err();
    let message = refused.expect("the files are taken").to_string();
    assert!(!message.contains('\n'), "{message}");
    let key = fs::read_to_string(&files.options.private_key).unwrap_or_default();
    for line in key.lines().filter(|line| line.len() > 20) {
        assert!(!message.contains(line), "{message}");
    }
    message
}

fn der(pair: &Pair) -> Vec<u8> {
    let certificate = CertificateDer::from_pem_slice(pair.certificate.as_bytes());
    certificate.unwrap().to_vec()
}

fn has_metric(tls: &Tls, line: &str) {
    let text = tls.metrics.render().unwrap();
    assert!(text.contains(&format!("\n{line}\n")), "{line}: {text}");
}

#[tokio::test]
async fn clients_of_both_versions_of_tls_are_served_over_http_1() {
    let authority = Authority::new();
    let tls = open(&Files::new(&authority.issue()));
    let address = echo(&tls).await;
    for (versions, expected) in [
        (&[&TLS12][..], ProtocolVersion::TLSv1_2),
        (&[&TLS13], ProtocolVersion::TLSv1_3),
    ] {
        let client = Client::new(&authority, None, versions);
        let connection = client.talk(address).await.unwrap();
        let session = connection.get_ref().1;
        assert_eq!(session.protocol_version(), Some(expected));
        assert_eq!(session.alpn_protocol(), Some(&b"http/1.1"[..]));
    }
    has_metric(&tls, "lookdown_tls_handshakes_total{result=\"success\"} 2");
    // 1 January 2090.
    has_metric(
        &tls,
        "lookdown_tls_certificate_expiry_timestamp_seconds 3786912000",
    );
}

#[tokio::test]
async fn a_client_without_the_authority_ends_the_handshake() {
    let tls = open(&Files::new(&Authority::new().issue()));
    let address = echo(&tls).await;
    let stranger = Client::new(&Authority::new(), None, BOTH);
    assert!(stranger.talk(address).await.is_err());
}

#[tokio::test]
async fn a_changed_certificate_applies_to_new_connections_only() {
    let authority = Authority::new();
    let (old, new) = (authority.issue(), authority.issue_until(2080));
    let files = Files::new(&old);
    let tls = open(&files);
    let address = echo(&tls).await;
    let client = Client::new(&authority, None, BOTH);
    let mut before = client.talk(address).await.unwrap();
    assert_eq!(shown(&before), der(&old));

    files.replace(&new);
    tls.refresh();
    let after = client.talk(address).await.unwrap();
    assert_eq!(shown(&after), der(&new));
    exchange(&mut before).await.unwrap();
    has_metric(
        &tls,
        "lookdown_tls_certificate_loads_total{result=\"success\"} 2",
    );
    has_metric(
        &tls,
        "lookdown_tls_certificate_loads_total{result=\"failure\"} 0",
    );
    has_metric(
        &tls,
        "lookdown_tls_certificate_expiry_timestamp_seconds 3471292800",
    );
}

#[tokio::test]
async fn a_changed_symbolic_link_changes_the_files() {
    let authority = Authority::new();
    let (old, new) = (Files::new(&authority.issue()), authority.issue());
    let newer = Files::new(&new);
    let folder = tempfile::tempdir().unwrap();
    let link = folder.path().join("current");
    let mut linked = Files::new(&new);
    linked.options.certificate = link.join("server.pem");
    linked.options.private_key = link.join("server.key");
    symlink(old.options.certificate.parent().unwrap(), &link).unwrap();
    let tls = open(&linked);
    let address = echo(&tls).await;

    let other = folder.path().join("next");
    symlink(newer.options.certificate.parent().unwrap(), &other).unwrap();
    fs::rename(&other, &link).unwrap();
    tls.refresh();
    let client = Client::new(&authority, None, BOTH);
    assert_eq!(shown(&client.talk(address).await.unwrap()), der(&new));
}

#[tokio::test]
async fn an_invalid_replacement_is_logged_once_and_not_used() {
    let authority = Authority::new();
    let (pair, other) = (authority.issue(), authority.issue());
    let files = Files::new(&pair);
    let tls = open(&files);
    let address = echo(&tls).await;
    let client = Client::new(&authority, None, BOTH);

    fs::write(&files.options.certificate, &other.certificate).unwrap();
    let log = logged_by(|| {
        tls.refresh();
        tls.refresh();
    });
    assert_eq!(log.matches("ERROR").count(), 1, "{log}");
    assert!(
        log.contains("server.pem") && log.contains("is not that of"),
        "{log}"
    );
    assert_eq!(shown(&client.talk(address).await.unwrap()), der(&pair));

    fs::remove_file(&files.options.private_key).unwrap();
    let log = logged_by(|| tls.refresh());
    assert!(log.contains("server.key cannot be read"), "{log}");
    assert_eq!(shown(&client.talk(address).await.unwrap()), der(&pair));
    has_metric(
        &tls,
        "lookdown_tls_certificate_loads_total{result=\"failure\"} 2",
    );

    files.replace(&other);
    tls.refresh();
    assert_eq!(shown(&client.talk(address).await.unwrap()), der(&other));
}

#[tokio::test]
async fn only_clients_certified_by_the_authorities_are_served() {
    let (authority, of_clients) = (Authority::new(), Authority::new());
    let mut files = Files::new(&authority.issue());
    files.ask_clients(&of_clients.pem());
    let tls = open(&files);
    let address = echo(&tls).await;
    for version in [&[&TLS12][..], &[&TLS13]] {
        let own = of_clients.issue();
        let client = Client::new(&authority, Some(&own), version);
        client.talk(address).await.unwrap();

        let uncertified = Client::new(&authority, None, version);
        assert!(uncertified.talk(address).await.is_err());
        let strange = authority.issue();
        let stranger = Client::new(&authority, Some(&strange), version);
        assert!(stranger.talk(address).await.is_err());
        let expired = of_clients.issue_until(2001);
        let late = Client::new(&authority, Some(&expired), version);
        assert!(late.talk(address).await.is_err());
    }
    has_metric(&tls, "lookdown_tls_handshakes_total{result=\"failure\"} 6");
}

#[tokio::test]
async fn changed_client_authorities_apply_to_resumed_sessions_too() {
    let (authority, old, new) = (Authority::new(), Authority::new(), Authority::new());
    let mut files = Files::new(&authority.issue());
    let of_clients = files.ask_clients(&old.pem());
    let tls = open(&files);
    let address = echo(&tls).await;
    let client = Client::new(&authority, Some(&old.issue()), BOTH);
    client.talk(address).await.unwrap();
    client.talk(address).await.unwrap();

    fs::write(of_clients, new.pem()).unwrap();
    tls.refresh();
    assert!(client.talk(address).await.is_err());
}

#[tokio::test]
async fn plain_http_gets_an_answer_that_names_tls() {
    let tls = open(&Files::new(&Authority::new().issue()));
    let mut connection = TcpStream::connect(echo(&tls).await).await.unwrap();
    let request = format!(
        "POST /detect HTTP/1.1\r\nContent-Length: 9\r\n\r\n{}",
        "123456789"
    );
    connection.write_all(request.as_bytes()).await.unwrap();
    connection.shutdown().await.unwrap();
    let mut answer = String::new();
    connection.read_to_string(&mut answer).await.unwrap();
    assert!(answer.starts_with("HTTP/1.1 400 "), "{answer}");
    assert!(answer.contains("https://"), "{answer}");
}

#[tokio::test]
async fn a_silent_client_is_disconnected_after_the_timeout() {
    let mut files = Files::new(&Authority::new().issue());
    files.options.handshake_timeout = Duration::from_millis(20);
    let tls = open(&files);
    let address = echo(&tls).await;
    for beginning in [&b""[..], &[22]] {
        let mut connection = TcpStream::connect(address).await.unwrap();
        connection.write_all(beginning).await.unwrap();
        let mut answer = Vec::new();
        // Unread bytes cause a reset at the end.
        let _ = connection.read_to_end(&mut answer).await;
    }
    has_metric(&tls, "lookdown_tls_handshakes_total{result=\"timeout\"} 2");
}

#[test]
fn errors_of_files_name_setting_file_and_remedy() {
    let authority = Authority::new();
    let (pair, other) = (authority.issue(), authority.issue());
    let half = |pem: &str| pem[..pem.len() / 2].to_owned();
    let junk = pair.certificate.replace("MII", "AAA");
    for (certificate, private_key, expected) in [
        (
            "",
            &*pair.private_key,
            "server.tls.certificate: there is no certificate in",
        ),
        (
            &pair.private_key,
            &pair.private_key,
            "there is no certificate in",
        ),
        (
            &half(&pair.certificate),
            &pair.private_key,
            "server.tls.certificate: ",
        ),
        (&junk, &pair.private_key, "certificate 1 in"),
        (
            &pair.certificate,
            "",
            "server.tls.private_key: there is no private key in",
        ),
        (
            &pair.certificate,
            &pair.certificate,
            "there is no private key in",
        ),
        (&pair.certificate, &half(&pair.private_key), "damaged PEM"),
        (
            &pair.certificate,
            &other.private_key,
            "is not that of the first certificate in",
        ),
        (
            &pair.certificate,
            "-----BEGIN PRIVATE KEY-----\nAAAA\n-----END PRIVATE KEY-----\n",
            "cannot be used: give an RSA key",
        ),
    ] {
        let files = Files::new(&Pair {
            certificate: certificate.to_owned(),
            private_key: private_key.to_owned(),
        });
        let message = refusal(&files);
        assert!(message.contains(expected), "{message}");
        assert!(
            message.contains("server.pem") || message.contains("server.key"),
            "{message}"
        );
    }
}

#[test]
fn errors_of_missing_or_large_files_and_authorities_name_them() {
    let pair = Authority::new().issue();
    let mut files = Files::new(&pair);
    for (authorities, expected) in [
        (
            "",
            "server.tls.client_certificates: there is no certificate in",
        ),
        (&*pair.private_key, "there is no certificate in"),
        (&pair.certificate.replace("MII", "AAA"), "certificate 1 in"),
        (&"#".repeat(2 << 20), "more than 1 MiB"),
    ] {
        files.ask_clients(authorities);
        let message = refusal(&files);
        assert!(
            message.contains(expected) && message.contains("clients.pem"),
            "{message}"
        );
    }
    fs::remove_file(&files.options.certificate).unwrap();
    let message = refusal(&files);
    assert!(message.starts_with("server.tls.certificate: "), "{message}");
    assert!(message.contains("server.pem cannot be read"), "{message}");
}

#[test]
fn certificate_and_private_key_may_be_in_one_file() {
    let mut pair = Authority::new().issue();
    pair.certificate.push_str(&pair.private_key);
    let mut files = Files::new(&pair);
    files.options.private_key = files.options.certificate.clone();
    open(&files);
}

#[test]
fn only_certificates_with_problems_cause_warnings() {
    let authority = Authority::new();
    let files = Files::new(&authority.issue());
    let quiet = logged_by(|| drop(open(&files)));
    assert!(!quiet.contains("WARN"), "{quiet}");

    let_read(&files.options.private_key, 0o640);
    let of_a_group = logged_by(|| drop(open(&files)));
    assert!(!of_a_group.contains("WARN"), "{of_a_group}");
    let_read(&files.options.private_key, 0o644);
    let readable = logged_by(|| drop(open(&files)));
    assert!(
        readable.contains("every user of this machine may read"),
        "{readable}"
    );

    let expired = Files::new(&authority.issue_until(2001));
    let expired = logged_by(|| drop(open(&expired)));
    assert!(expired.contains("has expired at 2001-01-01"), "{expired}");
}

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
