//! An HTTP server that records its requests, and answers them with a function.

use std::{sync::Arc, time::Duration};

use parking_lot::Mutex;
use tokio::{
    io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufStream},
    net::{TcpListener, TcpStream},
    time::sleep,
};

/// A received request.
#[derive(Debug, Clone, Default)]
pub(crate) struct Request {
    /// The request line and the headers.
    pub(crate) head: String,
    pub(crate) body: Vec<u8>,
}

/// The answer to a request.
pub(crate) enum Reply {
    /// The head without its length, and the body.
    Now(String, Vec<u8>),
    /// An answer after a pause.
    Slow(Duration, Box<Reply>),
    /// No answer on an open connection.
    Silence,
}

impl Reply {
    pub(crate) fn ok(content_type: &str, body: &[u8]) -> Self {
        Self::Now(
            format!("HTTP/1.1 200 OK\r\nContent-Type: {content_type}\r\n"),
            body.to_vec(),
        )
    }

    pub(crate) fn status(status: u16) -> Self {
        Self::Now(format!("HTTP/1.1 {status} Status\r\n"), Vec::new())
    }

    pub(crate) fn with(self, name: &str, value: &str) -> Self {
        match self {
            Self::Now(head, body) => Self::Now(format!("{head}{name}: {value}\r\n"), body),
            other => other,
        }
    }
}

/// A running server.
pub(crate) struct Exchange {
    port: u16,
    requests: Arc<Mutex<Vec<Request>>>,
}

impl Exchange {
    pub(crate) fn url(&self, path: &str) -> String {
        format!("http://127.0.0.1:{}/{path}", self.port)
    }

    /// The number of requests so far.
    pub(crate) fn count(&self) -> usize {
        self.requests.lock().len()
    }

    pub(crate) fn request(&self, index: usize) -> Request {
        self.requests.lock()[index].clone()
    }
}

/// Starts a server.
pub(crate) async fn serve(answer: impl Fn(&Request) -> Reply + Send + Sync + 'static) -> Exchange {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let port = listener.local_addr().unwrap().port();
    let requests = Arc::new(Mutex::new(Vec::new()));
    let (answer, recorded) = (Arc::new(answer), Arc::clone(&requests));
    tokio::spawn(async move {
        while let Ok((connection, _)) = listener.accept().await {
            let (answer, recorded) = (Arc::clone(&answer), Arc::clone(&recorded));
            tokio::spawn(async move {
                let mut connection = BufStream::new(connection);
                while let Some(request) = read(&mut connection).await {
                    let mut reply = answer(&request);
                    recorded.lock().push(request);
                    if let Reply::Slow(pause, later) = reply {
                        sleep(pause).await;
                        reply = *later;
                    }
                    let Reply::Now(head, body) = reply else {
                        return std::future::pending().await;
                    };
                    let head = format!("{head}Content-Length: {}\r\n\r\n", body.len());
                    let sent = connection
                        .write_all(&[head.as_bytes(), &body].concat())
                        .await;
                    if sent.is_err() || connection.flush().await.is_err() {
                        return;
                    }
                }
            });
        }
    });
    Exchange { port, requests }
}

async fn read(connection: &mut BufStream<TcpStream>) -> Option<Request> {
    let mut request = Request::default();
    let mut length = 0;
    loop {
        let mut line = String::new();
        if connection.read_line(&mut line).await.ok()? == 0 {
            return None;
        }
        if let Some(value) = line.to_ascii_lowercase().strip_prefix("content-length:") {
            length = value.trim().parse().ok()?;
        }
        if line.trim().is_empty() {
            break;
        }
        request.head.push_str(&line);
    }
    request.body.resize(length, 0);
    connection.read_exact(&mut request.body).await.ok()?;
    Some(request)
}
