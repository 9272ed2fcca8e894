//! The metrics of the cameras, in a registry of their own.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use lookdown_common::{metric_set, metrics::text};
use parking_lot::Mutex;
use prometheus::{GaugeVec, IntCounter, IntCounterVec, IntGauge, Registry};
use strum::{IntoStaticStr, VariantArray};

use crate::{Frame, Viewers, operating_point::Choice, rate::Rate};

/// The reason why a frame did not become a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "lowercase")]
pub(crate) enum Failure {
    /// The camera sent a file that is not a whole image.
    Damaged,
    /// The server was busy (429, 503).
    Overloaded,
    /// The server refused the frame or the request.
    Refused,
    /// The server could not be reached, or failed.
    Unreachable,
}

metric_set! {
    /// The series of all cameras.
    pub(crate) struct Series {
        registry: Registry,
    }

    /// Time since the camera's last whole frame, or since its start without a frame.
    age: GaugeVec = "last_frame_age_seconds" ["camera"];
    /// Whole frames of the camera.
    received: IntCounterVec = "frames_received_total" ["camera"];
    /// Frames for which the server returned a report.
    sent: IntCounterVec = "frames_sent_total" ["camera"];
    /// Frames replaced by a newer one before they were sent.
    skipped: IntCounterVec = "frames_skipped_total" ["camera"];
    /// Frames without a report, by reason: damaged, overloaded, refused, unreachable.
    failed: IntCounterVec = "frames_failed_total" ["camera", "reason"];
    /// Restarts of the source of the camera.
    reconnects: IntCounterVec = "reconnects_total" ["camera"];
    /// Open connections of clients.
    connections: IntGauge = "connections" [];
}

/// The metrics of all cameras.
pub struct Metrics {
    pub(crate) series: Series,
    cameras: Mutex<Vec<Arc<CameraMetrics>>>,
    viewers: Arc<Viewers>,
}

/// The metrics of one camera.
pub(crate) struct CameraMetrics {
    camera: String,
    viewers: Arc<Viewers>,
    last_frame: Mutex<Instant>,
    /// Whole frames of the camera.
    pub(crate) received: IntCounter,
    /// Frames for which the server returned a report.
    pub(crate) sent: IntCounter,
    pub(crate) skipped: IntCounter,
    /// Frames without a report, in the order of the reasons.
    failed: Vec<IntCounter>,
    pub(crate) reconnects: IntCounter,
    /// The state, without the age of the last frame.
    state: Mutex<CameraState>,
}

/// The state of a camera.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CameraState {
    /// Its name.
    pub name: String,
    /// Its source, without credentials.
    pub source: String,
    /// Time since the last whole frame, or since the start without a frame.
    pub last_frame_age: Duration,
    /// The rate of the last whole minute.
    pub rate: Option<Rate>,
    /// The profile and the rate, once they are chosen.
    pub choice: Option<Choice>,
    /// The reason and the remedies, if less than 80 % of the wanted rate is reached.
    pub warning: Option<String>,
    /// The reason why the source gives no frames.
    pub problem: Option<String>,
}

impl Metrics {
    /// Creates and registers all metrics.
    ///
    /// # Errors
    /// If two metrics share a name.
    pub fn new() -> Result<Self, prometheus::Error> {
        let registry = Registry::new_custom(Some("lookdown_watch".to_owned()), None)?;
        Ok(Self {
            series: Series::registered_with(&registry.clone(), registry)?,
            cameras: Mutex::default(),
            viewers: Arc::default(),
        })
    }

    /// Adds a camera.
    pub(crate) fn add(&self, camera: &str, source: String) -> Arc<CameraMetrics> {
        let series = &self.series;
        let of = |counter: &IntCounterVec| counter.with_label_values(&[camera]);
        let failed = Failure::VARIANTS.iter();
        let failed = failed.map(|reason| series.failed.with_label_values(&[camera, reason.into()]));
        let metrics = Arc::new(CameraMetrics {
            camera: camera.to_owned(),
            viewers: Arc::clone(&self.viewers),
            last_frame: Mutex::new(Instant::now()),
            received: of(&series.received),
            sent: of(&series.sent),
            skipped: of(&series.skipped),
            failed: failed.collect(),
            reconnects: of(&series.reconnects),
            state: Mutex::new(CameraState {
                name: camera.to_owned(),
                source,
                ..CameraState::default()
            }),
        });
        let mut cameras = self.cameras.lock();
        cameras.retain(|other| other.camera != camera);
        cameras.push(Arc::clone(&metrics));
        metrics
    }

    /// Removes a camera with its series.
    pub(crate) fn remove(&self, camera: &str) {
        self.cameras.lock().retain(|other| other.camera != camera);
        let series = &self.series;
        for counter in [
            &series.received,
            &series.sent,
            &series.skipped,
            &series.reconnects,
        ] {
            // A missing series is as good.
            let _ = counter.remove_label_values(&[camera]);
        }
        let _ = series.age.remove_label_values(&[camera]);
        for reason in Failure::VARIANTS {
            let _ = series.failed.remove_label_values(&[camera, reason.into()]);
        }
    }

    /// Returns the viewers of the cameras.
    pub fn viewers(&self) -> &Arc<Viewers> {
        &self.viewers
    }

    /// Returns the states of all cameras.
    pub fn states(&self) -> Vec<CameraState> {
        let cameras = self.cameras.lock();
        let states = cameras.iter().map(|camera| {
            let state = camera.state.lock().clone();
            let of_choice = state.choice.as_ref().and_then(Choice::warning);
            CameraState {
                last_frame_age: camera.last_frame.lock().elapsed(),
                warning: state.warning.or(of_choice),
                ..state
            }
        });
        states.collect()
    }

    /// Returns all metrics in the text format of Prometheus.
    pub fn text(&self) -> Vec<u8> {
        for camera in self.cameras.lock().iter() {
            let age = camera.last_frame.lock().elapsed().as_secs_f64();
            let row = self.series.age.with_label_values(&[&camera.camera]);
            row.set(age);
        }
        // Writing to memory does not fail.
        text(&[&self.series.registry])
            .unwrap_or_default()
            .into_bytes()
    }
}

impl CameraMetrics {
    pub(crate) fn received(&self, frame: &Frame) {
        *self.last_frame.lock() = frame.received;
        self.state.lock().problem = None;
        self.received.inc();
        self.viewers.offer(&self.camera, frame);
    }

    /// Returns true while all frames of the camera are shown.
    pub(crate) fn has_viewers(&self) -> bool {
        self.viewers.has_any(&self.camera)
    }

    /// Waits until that changes.
    pub(crate) async fn viewers_changed(&self, had_any: bool) {
        self.viewers.changed(&self.camera, had_any).await;
    }

    pub(crate) fn failed(&self, reason: Failure) {
        let reasons = Failure::VARIANTS.iter().zip(&self.failed);
        for (_, counter) in reasons.filter(|(other, _)| **other == reason) {
            counter.inc();
        }
    }

    /// Stores the rate of a minute.
    pub(crate) fn measured(&self, rate: Rate, warning: Option<String>) {
        let mut state = self.state.lock();
        (state.rate, state.warning) = (Some(rate), warning);
    }

    /// Stores the profile and the rate in use. Logs a change.
    pub(crate) fn chose(&self, choice: Choice) {
        let last = &mut self.state.lock().choice;
        if last.as_ref().is_none_or(|last| !last.is_same(&choice)) {
            tracing::info!("{choice}");
        }
        *last = Some(choice);
    }

    /// Stores the reason why the source gives no frames.
    pub(crate) fn ended(&self, problem: &str) {
        self.state.lock().problem = Some(problem.to_owned());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_removed_camera_loses_all_its_series() {
        let metrics = Metrics::new().unwrap();
        let hall = metrics.add("hall", String::new());
        metrics.add("gate", String::new());
        let jpeg = bytes::Bytes::from_static(b"\xff\xd8\xff\xe0..\xff\xd9");
        hall.received(&Frame::new(jpeg, jiff::Timestamp::UNIX_EPOCH).unwrap());
        hall.failed(Failure::Refused);
        let text = String::from_utf8(metrics.text()).unwrap();
        for series in [
            "lookdown_watch_last_frame_age_seconds{camera=\"gate\"}",
            "lookdown_watch_frames_received_total{camera=\"hall\"} 1",
            "lookdown_watch_frames_failed_total{camera=\"hall\",reason=\"refused\"} 1",
            "lookdown_watch_frames_failed_total{camera=\"hall\",reason=\"damaged\"} 0",
            "lookdown_watch_reconnects_total{camera=\"gate\"} 0",
        ] {
            assert!(text.contains(series), "{series} is missing in {text}");
        }
        metrics.remove("hall");
        let text = String::from_utf8(metrics.text()).unwrap();
        assert!(!text.contains("hall") && text.contains("gate"), "{text}");
    }
}
