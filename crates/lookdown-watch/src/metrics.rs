//! The metrics of the cameras, in a registry of their own.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use parking_lot::Mutex;
use prometheus::{
    Encoder, GaugeVec, IntCounter, IntCounterVec, IntGauge, Opts, Registry, TextEncoder,
};

use crate::rate::Rate;

/// The reason why a frame did not become a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
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

impl Failure {
    const ALL: [Self; 4] = [
        Self::Damaged,
        Self::Overloaded,
        Self::Refused,
        Self::Unreachable,
    ];

    fn label(self) -> &'static str {
        match self {
            Self::Damaged => "damaged",
            Self::Overloaded => "overloaded",
            Self::Refused => "refused",
            Self::Unreachable => "unreachable",
        }
    }
}

/// The metrics of all cameras.
pub struct Metrics {
    registry: Registry,
    age: GaugeVec,
    received: IntCounterVec,
    sent: IntCounterVec,
    skipped: IntCounterVec,
    failed: IntCounterVec,
    reconnects: IntCounterVec,
    /// Open connections of clients.
    pub(crate) connections: IntGauge,
    cameras: Mutex<Vec<Arc<CameraMetrics>>>,
}

/// The metrics of one camera.
pub(crate) struct CameraMetrics {
    camera: String,
    last_frame: Mutex<Instant>,
    received: IntCounter,
    sent: IntCounter,
    skipped: IntCounter,
    failed: [IntCounter; Failure::ALL.len()],
    reconnects: IntCounter,
    /// The source, without credentials.
    source: String,
    rate: Mutex<Option<Rate>>,
    warning: Mutex<Option<String>>,
    problem: Mutex<Option<String>>,
}

/// The state of a camera.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraState {
    /// Its name.
    pub name: String,
    /// Its source, without credentials.
    pub source: String,
    /// Time since the last whole frame, or since the start without a frame.
    pub last_frame_age: Duration,
    /// The rate of the last whole minute.
    pub rate: Option<Rate>,
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
        let counter = |name: &str, help: &str, labels: &[&str]| {
            let counter = IntCounterVec::new(Opts::new(name, help), labels)?;
            registry.register(Box::new(counter.clone()))?;
            Ok::<_, prometheus::Error>(counter)
        };
        let of_camera = &["camera"];
        let age = GaugeVec::new(
            Opts::new(
                "last_frame_age_seconds",
                "Time since the camera's last whole frame, or since its start without a frame.",
            ),
            of_camera,
        )?;
        registry.register(Box::new(age.clone()))?;
        let connections = IntGauge::new("connections", "Open connections of clients.")?;
        registry.register(Box::new(connections.clone()))?;
        Ok(Self {
            age,
            connections,
            received: counter(
                "frames_received_total",
                "Whole frames of the camera.",
                of_camera,
            )?,
            sent: counter(
                "frames_sent_total",
                "Frames for which the server returned a report.",
                of_camera,
            )?,
            skipped: counter(
                "frames_skipped_total",
                "Frames replaced by a newer one before they were sent.",
                of_camera,
            )?,
            failed: counter(
                "frames_failed_total",
                "Frames without a report, by reason: damaged, overloaded, refused, unreachable.",
                &["camera", "reason"],
            )?,
            reconnects: counter(
                "reconnects_total",
                "Restarts of the source of the camera.",
                of_camera,
            )?,
            registry,
            cameras: Mutex::default(),
        })
    }

    /// Adds a camera.
    pub(crate) fn add(&self, camera: &str, source: String) -> Arc<CameraMetrics> {
        let of = |counter: &IntCounterVec| counter.with_label_values(&[camera]);
        let metrics = Arc::new(CameraMetrics {
            camera: camera.to_owned(),
            last_frame: Mutex::new(Instant::now()),
            received: of(&self.received),
            sent: of(&self.sent),
            skipped: of(&self.skipped),
            failed: Failure::ALL
                .map(|reason| self.failed.with_label_values(&[camera, reason.label()])),
            reconnects: of(&self.reconnects),
            source,
            rate: Mutex::default(),
            warning: Mutex::default(),
            problem: Mutex::default(),
        });
        let mut cameras = self.cameras.lock();
        cameras.retain(|other| other.camera != camera);
        cameras.push(Arc::clone(&metrics));
        metrics
    }

    /// Removes a camera with its series.
    pub(crate) fn remove(&self, camera: &str) {
        self.cameras.lock().retain(|other| other.camera != camera);
        let counters = [&self.received, &self.sent, &self.skipped, &self.reconnects];
        for counter in counters {
            // A missing series is as good.
            let _ = counter.remove_label_values(&[camera]);
        }
        let _ = self.age.remove_label_values(&[camera]);
        for reason in Failure::ALL {
            let _ = self.failed.remove_label_values(&[camera, reason.label()]);
        }
    }

    /// Returns the states of all cameras.
    #[must_use]
    pub fn states(&self) -> Vec<CameraState> {
        let cameras = self.cameras.lock();
        let states = cameras.iter().map(|camera| CameraState {
            name: camera.camera.clone(),
            source: camera.source.clone(),
            last_frame_age: camera.last_frame.lock().elapsed(),
            rate: *camera.rate.lock(),
            warning: camera.warning.lock().clone(),
            problem: camera.problem.lock().clone(),
        });
        states.collect()
    }

    /// Returns all metrics in the text format of Prometheus.
    #[must_use]
    pub fn text(&self) -> Vec<u8> {
        for camera in self.cameras.lock().iter() {
            let age = camera.last_frame.lock().elapsed().as_secs_f64();
            self.age.with_label_values(&[&camera.camera]).set(age);
        }
        let mut text = Vec::new();
        // Writing to memory does not fail.
        let _ = TextEncoder::new().encode(&self.registry.gather(), &mut text);
        text
    }
}

impl CameraMetrics {
    pub(crate) fn received(&self, at: Instant) {
        *self.last_frame.lock() = at;
        *self.problem.lock() = None;
        self.received.inc();
    }

    pub(crate) fn sent(&self) {
        self.sent.inc();
    }

    pub(crate) fn skipped(&self) {
        self.skipped.inc();
    }

    pub(crate) fn failed(&self, reason: Failure) {
        let reasons = Failure::ALL.iter().zip(&self.failed);
        for (_, counter) in reasons.filter(|(other, _)| **other == reason) {
            counter.inc();
        }
    }

    /// Stores the rate of a minute.
    pub(crate) fn measured(&self, rate: Rate, warning: Option<String>) {
        *self.rate.lock() = Some(rate);
        *self.warning.lock() = warning;
    }

    /// Stores the reason why the source gives no frames.
    pub(crate) fn ended(&self, problem: &str) {
        *self.problem.lock() = Some(problem.to_owned());
    }

    pub(crate) fn reconnected(&self) {
        self.reconnects.inc();
    }

    /// The number of frames for which the server returned a report.
    pub(crate) fn reports(&self) -> u64 {
        self.sent.get()
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
        hall.received(Instant::now());
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
