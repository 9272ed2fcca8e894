//! Requests to the Lookdown server.

use std::time::Duration;

use lookdown_common::{ClientError, ServerClient, ServerOptions, read_body, retry_after};
use reqwest::{Response, StatusCode, Url, header::CONTENT_TYPE};

use crate::{Camera, Frame};

/// Longest time for a report.
const REPORT_TIMEOUT: Duration = Duration::from_secs(35);
/// Largest answer that is read: a report, with images where they are asked for.
const MAX_ANSWER_BYTES: usize = 32 << 20;

/// A connection to the server.
pub(crate) struct Server {
    client: ServerClient,
    detect: Url,
}

/// The answer to a frame.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Answer {
    /// The server returned a report.
    Report,
    /// The server is busy. Holds the time of `Retry-After`.
    Busy(String, Option<Duration>),
    /// The server refuses the frame or its parameters.
    Refused(String),
    /// The server cannot be reached, or failed.
    Failed(String),
}

impl Server {
    /// Creates the client. Sends nothing.
    ///
    /// # Errors
    /// [`ClientError`] if the authorities cannot be used.
    pub(crate) fn new(options: &ServerOptions) -> Result<Self, ClientError> {
        let client = ServerClient::new(options)?;
        let detect = client.route(["detect"]);
        Ok(Self { client, detect })
    }

    /// Sends a frame, and waits for its report.
    pub(crate) async fn detect(&self, camera: &Camera, frame: &Frame) -> Answer {
        let mut url = self.detect.clone();
        url.query_pairs_mut()
            .extend_pairs(&camera.parameters)
            .append_pair("captured_at", &frame.captured_at.to_string());
        let request = self.client.post(url).timeout(REPORT_TIMEOUT);
        let request = request.header(CONTENT_TYPE, frame.format.media_type());
        match self.client.send(request.body(frame.image.clone())).await {
            Ok(response) => self.answer(response).await,
            Err(error) => Answer::Failed(self.client.failure(&error)),
        }
    }

    async fn answer(&self, response: Response) -> Answer {
        let status = response.status();
        if status.is_success() {
            // The rest is read so that the connection can be used again.
            return match read_body(response, MAX_ANSWER_BYTES).await {
                Ok(_) => Answer::Report,
                Err(error) => Answer::Failed(self.client.failure(&error)),
            };
        }
        let retry_after = retry_after(response.headers());
        let message = self.client.refusal(response).await;
        match status {
            StatusCode::TOO_MANY_REQUESTS | StatusCode::SERVICE_UNAVAILABLE => {
                Answer::Busy(message, retry_after)
            }
            status if status.is_client_error() && status != StatusCode::REQUEST_TIMEOUT => {
                Answer::Refused(message)
            }
            _ => Answer::Failed(message),
        }
    }
}
