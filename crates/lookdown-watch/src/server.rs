//! Requests to the Lookdown server.

use std::{
    borrow::Cow,
    time::{Duration, Instant},
};

use lookdown_common::{
    ClientError, InProcess, ServerClient, ServerOptions, read_body, retry_after,
};
use reqwest::{Method, Response, StatusCode, Url, header::CONTENT_TYPE};
use serde::Deserialize;

use crate::{Camera, Frame, memory_budget::frame_bytes, operating_point::FinishedSearch};

/// Longest time for a report.
const REPORT_TIMEOUT: Duration = Duration::from_secs(35);
/// Largest answer that is read: a report, with images where they are asked for.
const MAX_ANSWER_BYTES: usize = 32 << 20;

/// A connection to the server.
pub(crate) struct Server {
    client: ServerClient,
    detect: Url,
    in_process: Option<InProcess>,
}

/// The answer to a frame.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Answer {
    /// The server returned a report. Holds the search, if the whole frame was searched.
    Report(Option<FinishedSearch>),
    /// The server is busy. Holds the time of `Retry-After`.
    Busy(String, Option<Duration>),
    /// The server refuses the frame or its parameters.
    Refused(String),
    /// The server cannot be reached, or failed.
    Failed(String),
}

/// The parts of a report that tell what the server did.
#[derive(Deserialize)]
struct Work<'a> {
    #[serde(borrow)]
    profile: Cow<'a, str>,
    #[serde(borrow)]
    search: Cow<'a, str>,
    #[serde(borrow, default)]
    defaults: Vec<ServerDefault<'a>>,
}

/// A parameter that is a setting of the server or of the calibration.
#[derive(Deserialize)]
struct ServerDefault<'a> {
    #[serde(borrow)]
    name: Cow<'a, str>,
}

impl Server {
    /// Creates the client. Sends nothing.
    ///
    /// # Errors
    /// [`ClientError`] if the authorities cannot be used.
    pub(crate) fn new(options: &ServerOptions) -> Result<Self, ClientError> {
        let client = ServerClient::new(options)?;
        let detect = client.route(["detect"]);
        Ok(Self {
            client,
            detect,
            in_process: options.in_process.clone(),
        })
    }

    /// Returns the most bytes of a frame that a camera, one of so many, sends as pixels.
    pub(crate) fn most_pixel_bytes(&self, camera: &str, cameras: usize) -> usize {
        let server = self.in_process.as_ref();
        let most = server.map_or(0, |server| (server.most_pixel_bytes)(camera));
        most.min(frame_bytes(cameras))
    }

    /// Sends a frame, and waits for its report. `profile` replaces that of the server.
    pub(crate) async fn detect(
        &self,
        camera: &Camera,
        profile: Option<&str>,
        frame: &Frame,
    ) -> Answer {
        let mut url = self.detect.clone();
        url.query_pairs_mut()
            .extend_pairs(&camera.parameters)
            .extend_pairs(profile.map(|profile| ("profile", profile)))
            .append_pair("captured_at", &frame.captured_at.to_string());
        let began = Instant::now();
        let request = self
            .client
            .request(Method::POST, url)
            .timeout(REPORT_TIMEOUT);
        let request = request.header(CONTENT_TYPE, frame.format.media_type());
        match self.client.send(request.body(frame.image.clone())).await {
            Ok(response) => self.answer(response, began).await,
            Err(error) => Answer::Failed(self.client.failure(&error)),
        }
    }

    async fn answer(&self, response: Response, began: Instant) -> Answer {
        let status = response.status();
        if status.is_success() {
            return match read_body(response, MAX_ANSWER_BYTES).await {
                Ok(body) => Answer::Report(finished_search(&body, began.elapsed())),
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

/// Returns the search of a report; `None` if people were followed, or if the report is of an
/// unknown form.
fn finished_search(report: &[u8], took: Duration) -> Option<FinishedSearch> {
    let work: Work<'_> = serde_json::from_slice(report).ok()?;
    (work.search == "full").then(|| FinishedSearch {
        is_profile_named: work
            .defaults
            .iter()
            .any(|default| default.name == "profile"),
        profile: work.profile.into_owned(),
        took,
    })
}
