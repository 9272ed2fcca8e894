//! The shutdown of the server: no request is lost.

use std::{net::TcpStream, time::Duration};

use lookdown::api::Phase;
use tokio::{task::yield_now, time::timeout};

use crate::server::{Server, get, read_one_answer, rest_of};

const LONG_GRACE: (&str, &str) = ("SHUTDOWN__GRACE_MILLIS", "600000");
const LIVEZ: &[u8] = b"GET /livez HTTP/1.1\r\nHost: lookdown\r\n\r\n";

impl Server {
    /// Requests the shutdown and waits until it has begun.
    async fn is_told_to_stop(&self) {
        self.shutdown.request();
        while self.readiness.phase() != Phase::Stopping {
            yield_now().await;
        }
    }
}

/// Fails a test that would hang otherwise.
async fn soon<T>(work: impl Future<Output = T>) -> T {
    let waited = timeout(Duration::from_secs(30), work).await;
    waited.unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn in_the_grace_period_the_server_is_not_ready_but_serves() {
    let server = Server::start(&[LONG_GRACE]).await;
    let mut known = server.connect_and_ask();
    server.is_told_to_stop().await;
    let probe = server.get("/readyz").await;
    assert!(probe.contains("503 Service Unavailable"), "{probe}");
    assert!(probe.contains("/problems/shutting-down"));
    assert!(server.get("/livez").await.contains("200 OK"));
    assert!(server.detect().await.unwrap().unwrap().contains("200 OK"));

    for connection in [&mut known, &mut server.connect(b"")] {
        std::io::Write::write_all(connection, LIVEZ).unwrap();
        let answer = rest_of(connection.try_clone().unwrap()).await;
        assert!(answer.contains("200 OK"), "{answer}");
        assert!(answer.contains("\r\nconnection: close\r\n"), "{answer}");
    }
    server.shutdown.drain();
    soon(server.has_ended()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stopping_server_finishes_only_the_requests_that_arrived() {
    let server = Server::start(&[]).await;
    let idle = server.connect_and_ask();
    let silent = server.connect(b"");
    server.gate.close();
    let in_flight = server.detect();
    server.gate.has_begun(2).await;
    server.is_told_to_stop().await;
    assert_eq!(soon(rest_of(idle)).await, "");
    assert_eq!(soon(rest_of(silent)).await, "");
    while TcpStream::connect(server.address).is_ok() {
        yield_now().await;
    }
    server.gate.open();
    let answer = in_flight.await.unwrap().unwrap();
    assert!(answer.contains("200 OK"), "{answer}");
    soon(server.has_ended()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_connected_before_the_shutdown_is_served() {
    for _ in 0..10 {
        let server = Server::start(&[]).await;
        let connections: Vec<_> = (0..50).map(|_| server.connect(LIVEZ)).collect();
        server.shutdown.request_without_pause();
        for mut connection in connections {
            assert!(read_one_answer(&mut connection).contains("200 OK"));
        }
        soon(server.has_ended()).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn ctrl_c_skips_the_grace_period() {
    let server = Server::start(&[LONG_GRACE]).await;
    server.shutdown.request_without_pause();
    soon(server.has_ended()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_second_request_to_stop_ends_at_once() {
    for grace in [LONG_GRACE, ("SHUTDOWN__GRACE_MILLIS", "0")] {
        let server = Server::start(&[grace]).await;
        server.gate.close();
        let _in_flight = server.detect();
        server.gate.has_begun(2).await;
        server.is_told_to_stop().await;
        server.shutdown.request();
        let gate = std::sync::Arc::clone(&server.gate);
        soon(server.has_ended()).await;
        gate.open();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn draining_ends_at_its_timeout() {
    for setting in [
        ("SHUTDOWN__DRAIN_TIMEOUT_MILLIS", "200"),
        ("SERVER__REQUEST_TIMEOUT_MILLIS", "200"),
    ] {
        let server = Server::start(&[setting]).await;
        // In the middle of a request, and never closed.
        let stuck = server.connect(b"GET /livez HTTP/1.1\r\n");
        assert!(server.get("/livez").await.contains("200 OK"));
        server.shutdown.request();
        soon(server.has_ended()).await;
        assert_eq!(soon(rest_of(stuck)).await, "");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_metrics_port_serves_until_the_last_request_has_ended() {
    let server = Server::start(&[("SERVER__METRICS_LISTEN", "127.0.0.1:0")]).await;
    server.gate.close();
    let in_flight = server.detect();
    server.gate.has_begun(2).await;
    server.is_told_to_stop().await;
    while TcpStream::connect(server.address).is_ok() {
        yield_now().await;
    }
    let probe = get(server.metrics_address, "/readyz").await;
    assert!(probe.contains("503 Service Unavailable"), "{probe}");
    server.shows("pending_frames", 1).await;
    server.gate.open();
    assert!(in_flight.await.unwrap().unwrap().contains("200 OK"));
    soon(server.has_ended()).await;
}
