//! The connection to `/events` of the server.

use std::time::Duration;

use lookdown_common::{ServerClient, retry_after};
use reqwest::{Response, StatusCode};
use tokio::time::timeout;

use crate::event_parser::{Event, EventParser, TooLarge};

/// Longest time for the head of the response.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(20);
/// Longest silence: the server sends a comment every 15 seconds.
const SILENCE: Duration = Duration::from_secs(45);

/// The reason why a stream has ended or could not be opened.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub(crate) struct StreamError {
    pub(crate) message: String,
    /// The time of `Retry-After`.
    pub(crate) retry_after: Option<Duration>,
}

/// An open stream of events.
pub(crate) struct EventStream<'a> {
    client: &'a ServerClient,
    response: Response,
    parser: EventParser,
}

impl<'a> EventStream<'a> {
    /// Opens the stream after the event with this ID.
    pub(crate) async fn open(client: &'a ServerClient, after: u64) -> Result<Self, StreamError> {
        let mut request = client
            .get(client.route(["events"]))
            .header("accept", "text/event-stream");
        if after > 0 {
            request = request.header("last-event-id", after);
        }
        let response = match timeout(CONNECT_TIMEOUT, client.send(request)).await {
            Ok(Ok(response)) => response,
            Ok(Err(error)) => return Err(StreamError::new(client.failure(&error))),
            Err(_) => {
                let address = client.address();
                return Err(StreamError::new(format!(
                    "the server {address} does not answer in 20 s: check upstream.url"
                )));
            }
        };
        if response.status() != StatusCode::OK {
            let retry_after = retry_after(response.headers());
            return Err(StreamError {
                message: client.refusal(response).await,
                retry_after,
            });
        }
        Ok(Self {
            client,
            response,
            parser: EventParser::default(),
        })
    }

    /// Returns the next event. Cancel-safe.
    pub(crate) async fn next(&mut self) -> Result<Event, StreamError> {
        loop {
            match self.parser.next_event() {
                Ok(Some(event)) => return Ok(event),
                Ok(None) => {}
                Err(TooLarge) => {
                    let address = self.client.address();
                    let message = format!("{address}: {TooLarge}: check upstream.url");
                    return Err(StreamError::new(message));
                }
            }
            match timeout(SILENCE, self.response.chunk()).await {
                Ok(Ok(Some(chunk))) => self.parser.push(&chunk),
                Ok(Ok(None)) => return Err(self.ended("has ended the stream")),
                Ok(Err(error)) => return Err(StreamError::new(self.client.failure(&error.into()))),
                Err(_) => return Err(self.ended("was silent for 45 s")),
            }
        }
    }

    fn ended(&self, reason: &str) -> StreamError {
        StreamError::new(format!("the server {} {reason}", self.client.address()))
    }
}

impl StreamError {
    /// Returns the end that the companion itself causes.
    pub(crate) fn stopped() -> Self {
        Self::new(String::new())
    }

    fn new(message: String) -> Self {
        Self {
            message,
            retry_after: None,
        }
    }
}
