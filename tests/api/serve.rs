//! The service on a real socket: its start, and its timeouts for slow clients.

use std::{
    io::{Read, Write},
    sync::Arc,
    time::{Duration, Instant},
};

use tokio::task::spawn_blocking;

use crate::{
    detector::Gate,
    server::{Server, read_one_answer, rest_of},
};

/// The beginning of a request.
const PART_OF_A_HEAD: &[u8] = b"GET /livez HTTP/1.1\r\nHost: look";

#[tokio::test(flavor = "multi_thread")]
async fn the_server_is_ready_only_after_the_network_has_run() {
    let gate = Arc::new(Gate::default());
    gate.close();
    let server = Server::start_behind(gate, &[]).await;
    server.gate.has_begun(1).await;
    assert!(
        server
            .get("/readyz")
            .await
            .contains("503 Service Unavailable")
    );
    assert!(server.get("/livez").await.contains("200 OK"));
    let too_early = server.detect().await.unwrap().unwrap();
    assert!(too_early.contains("/problems/warming-up"), "{too_early}");
    server.gate.open();
    server.readiness.ready().await;
    assert!(server.get("/readyz").await.contains("200 OK"));
    assert!(server.detect().await.unwrap().unwrap().contains("200 OK"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_body_that_does_not_arrive_is_refused_with_408() {
    let server = Server::start(&[("SERVER__REQUEST_TIMEOUT_MILLIS", "100")]).await;
    let slow = server.exchange("POST /detect HTTP/1.1\r\nContent-Length: 1000", vec![1; 10]);
    let answer = slow.await.unwrap().unwrap();
    assert!(answer.contains("408 Request Timeout"), "{answer}");
    assert!(answer.contains("/problems/slow-upload"), "{answer}");
}

#[tokio::test(flavor = "multi_thread")]
async fn slow_loris_heads_are_disconnected_while_others_are_served() {
    let server = Server::start(&[("SERVER__HEADER_TIMEOUT_MILLIS", "300")]).await;
    let begun = Instant::now();
    let tricklers: Vec<_> = (0..20)
        .map(|_| {
            let mut connection = server.connect(PART_OF_A_HEAD);
            let pause = Duration::from_millis(20);
            connection.set_read_timeout(Some(pause)).unwrap();
            spawn_blocking(move || {
                let mut byte = [0];
                // The read timeout is the pause between two bytes; a read of 0 bytes is the end.
                while !matches!(connection.read(&mut byte), Ok(0))
                    && connection.write_all(b"d").is_ok()
                {}
            })
        })
        .collect();
    assert!(server.get("/livez").await.contains("200 OK"));
    assert!(server.detect().await.unwrap().unwrap().contains("200 OK"));
    for trickler in tricklers {
        trickler.await.unwrap();
    }
    assert!(begun.elapsed() >= Duration::from_millis(300));
    assert!(begun.elapsed() < Duration::from_secs(20));
    server.shows("connections", 0).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_silent_connection_is_closed() {
    let server = Server::start(&[("SERVER__HEADER_TIMEOUT_MILLIS", "100")]).await;
    let silent = server.connect(b"");
    assert_eq!(rest_of(silent).await, "");
    server.shows("connections", 0).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_idle_timeout_is_longer_than_the_header_timeout() {
    let chosen = [
        ("SERVER__HEADER_TIMEOUT_MILLIS", "50"),
        ("SERVER__IDLE_TIMEOUT_MILLIS", "400"),
    ];
    let server = Server::start(&chosen).await;
    let connection = server.connect_and_ask();
    let answered = Instant::now();
    assert_eq!(rest_of(connection).await, "");
    assert!(answered.elapsed() >= Duration::from_millis(300));
}

#[tokio::test(flavor = "multi_thread")]
async fn the_header_timeout_holds_for_later_requests() {
    let server = Server::start(&[("SERVER__HEADER_TIMEOUT_MILLIS", "100")]).await;
    let mut connection = server.connect_and_ask();
    let answered = Instant::now();
    connection.write_all(PART_OF_A_HEAD).unwrap();
    assert_eq!(rest_of(connection).await, "");
    // The connection itself could have stayed open for 75 seconds.
    assert!(answered.elapsed() < Duration::from_secs(20));
}

#[tokio::test(flavor = "multi_thread")]
async fn pipelined_requests_are_answered_in_order() {
    let server = Server::start(&[]).await;
    let one = b"GET /livez HTTP/1.1\r\nHost: lookdown\r\n\r\n";
    let mut connection = server.connect(&one.repeat(3));
    for _ in 0..3 {
        assert!(read_one_answer(&mut connection).contains("200 OK"));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_that_does_not_read_is_disconnected() {
    let server = Server::start(&[("SERVER__IDLE_TIMEOUT_MILLIS", "200")]).await;
    let one = b"GET /openapi.json HTTP/1.1\r\nHost: lookdown\r\n\r\n";
    // More than the socket buffers of both sides can hold.
    let hoarder = server.connect(&one.repeat(1000));
    server.shows("connections", 1).await;
    server.shows("connections", 0).await;
    drop(hoarder);
}

#[tokio::test(flavor = "multi_thread")]
async fn vanished_clients_leave_no_connection_and_no_frame() {
    let server = Server::start(&[]).await;
    let upload = b"POST /detect HTTP/1.1\r\nHost: lookdown\r\nContent-Length: 1000\r\n\r\n012345";
    let in_the_middle: Vec<_> = (0..20).map(|_| server.connect(upload)).collect();
    server.shows("connections", 20).await;
    drop(in_the_middle);
    server.shows("connections", 0).await;

    server.gate.close();
    let image = crate::service::frame();
    let head = format!(
        "POST /detect?calibration=lobby HTTP/1.1\r\nHost: lookdown\r\nContent-Length: {}\r\n\r\n",
        image.len()
    );
    let waiting: Vec<_> = (0..8)
        .map(|_| server.connect(&[head.as_bytes(), &image].concat()))
        .collect();
    server.shows("pending_frames", 8).await;
    drop(waiting);
    server.shows("connections", 0).await;
    server.gate.open();
    server.shows("pending_frames", 0).await;
}
