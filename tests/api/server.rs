//! The whole server on real sockets with a fake detector, and misbehaving clients.

use std::{
    collections::HashMap,
    io::{self, Read, Write},
    net::{SocketAddr, TcpStream},
    sync::Arc,
};

use lookdown::{
    api::Readiness,
    app::{App, Sockets},
    settings,
};
use lookdown_http::Shutdown;
use tempfile::TempDir;
use tokio::task::{JoinHandle, spawn_blocking};

use crate::{
    detector::Gate,
    service::{assembly, frame},
};

/// Settings of a test: keys as in the environment, without the prefix.
pub(crate) type Chosen = [(&'static str, &'static str)];

/// A running server.
pub(crate) struct Server {
    pub(crate) address: SocketAddr,
    /// The address of the metrics.
    pub(crate) metrics_address: SocketAddr,
    pub(crate) gate: Arc<Gate>,
    pub(crate) readiness: Readiness,
    pub(crate) shutdown: Shutdown,
    pub(crate) ended: JoinHandle<anyhow::Result<()>>,
    _calibrations: TempDir,
}

impl Server {
    /// Starts a server and waits until it is ready. Its grace period is 0 unless a test sets one.
    pub(crate) async fn start(chosen: &Chosen) -> Self {
        let server = Self::start_behind(Arc::default(), chosen).await;
        server.readiness.ready().await;
        server
    }

    /// Starts a server whose detector waits for the gate.
    pub(crate) async fn start_behind(gate: Arc<Gate>, chosen: &Chosen) -> Self {
        let mut environment = HashMap::from([
            (
                "LOOKDOWN__SERVER__LISTEN".to_owned(),
                "127.0.0.1:0".to_owned(),
            ),
            (
                "LOOKDOWN__SHUTDOWN__GRACE_MILLIS".to_owned(),
                "0".to_owned(),
            ),
        ]);
        for (key, value) in chosen {
            environment.insert(format!("LOOKDOWN__{key}"), (*value).to_owned());
        }
        let settings = settings::load(None, environment).unwrap();
        let sockets = Sockets::bind(&settings.server).await.unwrap();
        let (assembly, calibrations) = assembly(&gate);
        let app = App::start(assembly, settings).unwrap();
        let readiness = app.readiness();
        let address = sockets.main.local_addr().unwrap();
        let metrics_address = sockets.metrics.as_ref();
        let metrics_address =
            metrics_address.map_or(address, |socket| socket.local_addr().unwrap());
        let shutdown = Shutdown::default();
        Self {
            address,
            metrics_address,
            gate,
            readiness,
            ended: tokio::spawn(app.serve(sockets, shutdown.clone())),
            shutdown,
            _calibrations: calibrations,
        }
    }

    /// Opens a connection and sends these bytes.
    pub(crate) fn connect(&self, bytes: &[u8]) -> TcpStream {
        let mut connection = TcpStream::connect(self.address).unwrap();
        connection.write_all(bytes).unwrap();
        connection
    }

    /// Opens a connection with one completed request.
    pub(crate) fn connect_and_ask(&self) -> TcpStream {
        let mut connection = self.connect(b"GET /livez HTTP/1.1\r\nHost: lookdown\r\n\r\n");
        assert!(read_one_answer(&mut connection).contains("200 OK"));
        connection
    }

    /// Sends `head` and `body` on a new connection and reads the response to its end.
    pub(crate) fn exchange(&self, head: &str, body: Vec<u8>) -> JoinHandle<io::Result<String>> {
        exchange(self.address, head, body)
    }

    pub(crate) async fn get(&self, path: &str) -> String {
        get(self.address, path).await
    }

    pub(crate) fn detect(&self) -> JoinHandle<io::Result<String>> {
        let image = frame();
        let length = image.len();
        let path = "/detect?calibration=lobby&profile=fast";
        self.exchange(
            &format!("POST {path} HTTP/1.1\r\nContent-Length: {length}"),
            image,
        )
    }

    /// Waits until a metric without labels has this value. The connections of this check are not
    /// counted.
    pub(crate) async fn shows(&self, metric: &str, value: i64) {
        let own = i64::from(metric == "connections");
        let line = format!("\nlookdown_{metric} {}\n", value + own);
        while !get(self.metrics_address, "/metrics").await.contains(&line) {
            tokio::task::yield_now().await;
        }
    }

    /// Waits for the end of the server, which must succeed.
    pub(crate) async fn has_ended(self) {
        self.ended.await.unwrap().unwrap();
    }
}

pub(crate) async fn get(address: SocketAddr, path: &str) -> String {
    let answer = exchange(address, &format!("GET {path} HTTP/1.1"), Vec::new());
    answer.await.unwrap().unwrap()
}

fn exchange(address: SocketAddr, head: &str, body: Vec<u8>) -> JoinHandle<io::Result<String>> {
    let head = format!("{head}\r\nHost: lookdown\r\nConnection: close\r\n\r\n");
    spawn_blocking(move || {
        let mut connection = TcpStream::connect(address)?;
        connection.write_all(head.as_bytes())?;
        connection.write_all(&body)?;
        let mut answer = String::new();
        connection.read_to_string(&mut answer)?;
        Ok(answer)
    })
}

/// Reads a response on a connection that stays open; the response must have a length.
pub(crate) fn read_one_answer(connection: &mut TcpStream) -> String {
    let mut answer = Vec::new();
    let mut byte = [0];
    while !answer.ends_with(b"\r\n\r\n") {
        connection.read_exact(&mut byte).unwrap();
        answer.push(byte[0]);
    }
    let head = String::from_utf8(answer).unwrap();
    let (_, length) = head.split_once("content-length: ").unwrap();
    let length = length.lines().next().unwrap().parse().unwrap();
    let mut body = vec![0; length];
    connection.read_exact(&mut body).unwrap();
    head + str::from_utf8(&body).unwrap()
}

/// Reads everything until the server closes or resets the connection.
pub(crate) async fn rest_of(mut connection: TcpStream) -> String {
    let reading = spawn_blocking(move || {
        let mut bytes = Vec::new();
        // Bytes received before a reset count.
        let _ = connection.read_to_end(&mut bytes);
        String::from_utf8(bytes).unwrap()
    });
    reading.await.unwrap()
}
