//! The service on a real socket, from start to stop.

use std::{
    collections::HashMap,
    io::{self, Read, Write},
    net::{SocketAddr, TcpStream},
    sync::Arc,
    time::Duration,
};

use lookdown::{
    api::{Phase, Readiness},
    app::App,
    settings,
    shutdown::Shutdown,
};
use tempfile::TempDir;
use tokio::{
    net::TcpListener,
    task::{JoinHandle, spawn_blocking},
};

use crate::{
    detector::Gate,
    service::{assembly, frame},
};

struct Server {
    address: SocketAddr,
    gate: Arc<Gate>,
    readiness: Readiness,
    shutdown: Shutdown,
    ended: JoinHandle<anyhow::Result<()>>,
    _calibrations: TempDir,
}

impl Server {
    async fn start(timeout_millis: &str, gate: Arc<Gate>) -> Self {
        let variable = "LOOKDOWN__SERVER__REQUEST_TIMEOUT_MILLIS".to_owned();
        let environment = HashMap::from([(variable, timeout_millis.to_owned())]);
        let settings = settings::load(None, environment).unwrap();
        let (assembly, calibrations) = assembly(&gate);
        let app = App::start(assembly, settings).unwrap();
        let readiness = app.readiness();
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let shutdown = Shutdown::default();
        Self {
            address,
            gate,
            readiness,
            ended: tokio::spawn(app.serve(listener, shutdown.clone())),
            shutdown,
            _calibrations: calibrations,
        }
    }

    /// Sends `head` and `body` on a connection of their own and reads the answer to its end.
    fn exchange(&self, head: &str, body: Vec<u8>) -> JoinHandle<io::Result<String>> {
        let head = format!("{head}\r\nHost: lookdown\r\nConnection: close\r\n\r\n");
        let address = self.address;
        spawn_blocking(move || {
            let mut connection = TcpStream::connect(address)?;
            connection.write_all(head.as_bytes())?;
            connection.write_all(&body)?;
            let mut answer = String::new();
            connection.read_to_string(&mut answer)?;
            Ok(answer)
        })
    }

    async fn get(&self, path: &str) -> String {
        let answer = self.exchange(&format!("GET {path} HTTP/1.1"), Vec::new());
        answer.await.unwrap().unwrap()
    }

    fn detect(&self) -> JoinHandle<io::Result<String>> {
        let image = frame();
        let length = image.len();
        let path = "/detect?calibration=lobby&profile=fast";
        self.exchange(
            &format!("POST {path} HTTP/1.1\r\nContent-Length: {length}"),
            image,
        )
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_server_is_ready_only_after_the_network_has_run() {
    let gate = Arc::new(Gate::default());
    gate.close();
    let server = Server::start("20000", gate).await;
    server.gate.has_begun(1).await;
    assert!(
        server
            .get("/readyz")
            .await
            .contains("503 Service Unavailable")
    );
    assert!(server.get("/livez").await.contains("200 OK"));
    let too_early = server.detect().await.unwrap().unwrap();
    assert!(
        too_early.contains("urn:lookdown:problem:warming-up"),
        "{too_early}"
    );
    server.gate.open();
    server.readiness.ready().await;
    assert!(server.get("/readyz").await.contains("200 OK"));
    assert!(server.detect().await.unwrap().unwrap().contains("200 OK"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_server_that_is_told_to_stop_finishes_what_has_arrived() {
    let server = Server::start("20000", Arc::new(Gate::default())).await;
    server.readiness.ready().await;
    server.gate.close();
    let in_flight = server.detect();
    server.gate.has_begun(2).await;
    server.shutdown.request();
    while server.readiness.phase() != Phase::Stopping || TcpStream::connect(server.address).is_ok()
    {
        tokio::task::yield_now().await;
    }
    server.gate.open();
    let answer = in_flight.await.unwrap().unwrap();
    assert!(answer.contains("200 OK"), "{answer}");
    server.ended.await.unwrap().unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn the_second_request_to_stop_ends_at_once() {
    let server = Server::start("20000", Arc::new(Gate::default())).await;
    server.readiness.ready().await;
    server.gate.close();
    let _in_flight = server.detect();
    server.gate.has_begun(2).await;
    server.shutdown.request();
    server.shutdown.request();
    server.ended.await.unwrap().unwrap();
    server.gate.open();
}

#[tokio::test(flavor = "multi_thread")]
async fn stopping_takes_no_longer_than_a_request_may() {
    let server = Server::start("200", Arc::new(Gate::default())).await;
    server.readiness.ready().await;
    // A connection that asks for nothing and never leaves, in the middle of a request.
    let mut stuck = TcpStream::connect(server.address).unwrap();
    stuck.write_all(b"GET /livez HTTP/1.1\r\n").unwrap();
    assert!(server.get("/livez").await.contains("200 OK"));
    server.shutdown.request();
    let ended = tokio::time::timeout(Duration::from_secs(10), server.ended);
    ended
        .await
        .expect("the server does not stop")
        .unwrap()
        .unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_body_that_does_not_arrive_is_given_up() {
    let server = Server::start("100", Arc::new(Gate::default())).await;
    server.readiness.ready().await;
    let slow = server.exchange("POST /detect HTTP/1.1\r\nContent-Length: 1000", vec![1; 10]);
    let answer = slow.await.unwrap().unwrap();
    assert!(answer.contains("408 Request Timeout"), "{answer}");
    assert!(
        answer.contains("urn:lookdown:problem:slow-upload"),
        "{answer}"
    );
}
