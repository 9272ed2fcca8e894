//! The sources of frames, and their supervision: a source that fails or stalls is started again.

mod folder;
mod http;
mod multipart;
mod sink;
mod standard_input;
mod video;

use sink::Sink;
pub use standard_input::ImageReader;

use std::{convert::Infallible, sync::atomic::AtomicUsize, time::Duration};

use parking_lot::Mutex;
use tokio::time::sleep;

use crate::{
    Camera, Frame, Location, Metrics, SourceError, credentials::Login, metrics::CameraMetrics,
    slot::Slot,
};
use lookdown_common::{Backoff, HttpClient, LogOnce};

/// First and longest pause before a source is started again.
const PAUSES: (Duration, Duration) = (Duration::from_millis(500), Duration::from_secs(10));
/// First and longest pause after wrong credentials: cameras lock accounts after a few attempts.
const LOGIN_PAUSES: (Duration, Duration) = (Duration::from_secs(10), Duration::from_mins(5));

/// Fills the slot with the frames of a camera, those of a video as pixels if they are not larger
/// than `most_pixel_bytes`. Ends with the frames of a finite source, otherwise never.
pub(crate) async fn supervise(
    camera: &Camera,
    client: &HttpClient,
    (slot, most_pixel_bytes): (&Slot<Frame>, usize),
    metrics: &CameraMetrics,
) {
    let (first, longest) = PAUSES;
    let mut backoff = Backoff::new(first, longest);
    let (first, longest) = LOGIN_PAUSES;
    let mut login_backoff = Backoff::new(first, longest);
    let log = Mutex::new(LogOnce::default());
    let most_pixel_bytes = AtomicUsize::new(most_pixel_bytes);
    let mut login = Login::new(camera.credentials.clone());
    loop {
        login.restart();
        let sink = Sink::new(slot, metrics, &log, &most_pixel_bytes);
        let outcome = tokio::select! {
            outcome = run(camera, client, &mut login, &sink) => outcome,
            error = stalled(camera, &sink) => Err(error),
        };
        let pause = match outcome {
            Ok(()) => return,
            Err(error) => {
                metrics.ended(&error.to_string());
                if log.lock().should_log(&error.to_string()) {
                    tracing::warn!("{error}");
                }
                if error.is_refused_login() {
                    login_backoff.next_pause()
                } else {
                    login_backoff.reset();
                    backoff.reset_if_stable(sink.lifetime());
                    backoff.next_pause()
                }
            }
        };
        if camera.location.is_finite() {
            return;
        }
        sleep(pause).await;
        metrics.reconnects.inc();
    }
}

/// Returns the first frame of a camera, within this time.
///
/// # Errors
/// [`SourceError`].
pub async fn first_frame(camera: &Camera, limit: Duration) -> Result<Frame, SourceError> {
    let client =
        HttpClient::new(None).map_err(|error| SourceError::Unreachable(error.to_string()))?;
    let all = Metrics::new().map_err(|error| SourceError::Stream(error.to_string()))?;
    let metrics = all.add(&camera.name, camera.location.to_string());
    let (slot, log) = (Slot::default(), Mutex::new(LogOnce::default()));
    let mut login = Login::new(camera.credentials.clone());
    let no_pixels = AtomicUsize::new(0);
    let sink = Sink::new(&slot, &metrics, &log, &no_pixels);
    tokio::select! {
        biased;
        frame = slot.take() => frame.ok_or(SourceError::Closed),
        ended = run(camera, &client, &mut login, &sink) => {
            slot.close();
            let last = slot.take().await;
            last.ok_or_else(|| ended.err().unwrap_or(SourceError::Closed))
        }
        () = sleep(limit) => Err(SourceError::Stalled(limit)),
    }
}

/// Reads frames until the source ends.
async fn run(
    camera: &Camera,
    client: &HttpClient,
    login: &mut Login,
    sink: &Sink<'_>,
) -> Result<(), SourceError> {
    let ended: Infallible = match &camera.location {
        Location::Http(url) => http::run(camera, url, client, login, sink).await?,
        Location::Rtsp(url) => video::run_stream(camera, url, login, sink).await?,
        Location::Folder(path) => folder::run(camera, path, sink).await?,
        Location::Video(path) => return video::run_file(camera, path, sink).await,
        Location::StandardInput => return standard_input::run(sink).await,
    };
    match ended {}
}

/// Waits until the source stalls. Folders and standard input may be without frames for any time.
async fn stalled(camera: &Camera, sink: &Sink<'_>) -> SourceError {
    match camera.location {
        Location::Http(_) | Location::Rtsp(_) | Location::Video(_) => {
            sink.stalled(camera.stall_after).await
        }
        Location::Folder(_) | Location::StandardInput => std::future::pending().await,
    }
}
