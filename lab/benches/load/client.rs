//! A client with one keep-alive connection.

use std::{cell::RefCell, rc::Rc, time::Duration};

use bytes::Bytes;
use http_body_util::{BodyExt, Full};
use hyper::{
    Request, StatusCode,
    client::conn::http1::{SendRequest, handshake},
    header::{CONTENT_TYPE, HOST},
};
use hyper_util::rt::TokioIo;
use tokio::{
    net::TcpStream,
    time::{sleep_until, timeout},
};

use crate::{
    pace::Pace,
    tally::{Outcome, Tally},
};

/// The request and its server.
pub struct Target {
    /// Address and port.
    pub address: String,
    /// Paths and queries, used in turns.
    pub paths: Vec<String>,
    /// The media type of the body.
    pub content_type: String,
    /// The body.
    pub body: Bytes,
    /// The timeout of a response.
    pub timeout: Duration,
}

/// Sends requests one after the other.
pub struct Client {
    target: Rc<Target>,
    connection: Option<SendRequest<Full<Bytes>>>,
    turn: usize,
}

impl Client {
    /// Starts with the path for the client of this index.
    pub fn new(target: Rc<Target>, index: usize) -> Self {
        Self {
            target,
            connection: None,
            turn: index,
        }
    }

    /// Sends requests at their due times, until the end.
    pub async fn run(mut self, pace: Rc<RefCell<Pace>>, tally: Rc<RefCell<Tally>>) {
        let taken = || pace.borrow_mut().take();
        while let Some(due) = taken() {
            sleep_until(due).await;
            let target = Rc::clone(&self.target);
            let outcome = match timeout(target.timeout, self.exchange()).await {
                Ok(Ok((status, bytes))) => Outcome::Answered(status, bytes),
                Ok(Err(_)) => Outcome::Broken,
                Err(_) => Outcome::TimedOut,
            };
            if !matches!(outcome, Outcome::Answered(..)) {
                self.connection = None;
                // Avoids a busy loop while the server is down.
                tokio::time::sleep(Duration::from_millis(1)).await;
            }
            tally.borrow_mut().note(due, &outcome, target.body.len());
        }
    }

    async fn exchange(&mut self) -> anyhow::Result<(StatusCode, usize)> {
        let path = &self.target.paths[self.turn % self.target.paths.len()];
        self.turn += 1;
        let request = Request::post(path)
            .header(HOST, &self.target.address)
            .header(CONTENT_TYPE, &self.target.content_type)
            .body(Full::new(self.target.body.clone()))?;
        let mut connection = match self.connection.take() {
            Some(connection) if !connection.is_closed() => connection,
            _ => self.connect().await?,
        };
        connection.ready().await?;
        let answer = connection.send_request(request).await?;
        let status = answer.status();
        let mut body = answer.into_body();
        let mut received = 0;
        while let Some(frame) = body.frame().await {
            received += frame?.data_ref().map_or(0, Bytes::len);
        }
        self.connection = Some(connection);
        Ok((status, received))
    }

    async fn connect(&self) -> anyhow::Result<SendRequest<Full<Bytes>>> {
        let stream = TcpStream::connect(&self.target.address).await?;
        stream.set_nodelay(true)?;
        let (sender, connection) = handshake(TokioIo::new(stream)).await?;
        // The caller that waits for the response receives the error, too.
        tokio::spawn(connection);
        Ok(sender)
    }
}
