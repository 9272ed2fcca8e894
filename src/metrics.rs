//! Every metric of the server: one struct with its own registry. The doc comment of a field is its
//! help text. Each subsystem shares the struct and counts its own events in it. Label values come
//! from short fixed lists, never from clients. Those of cameras and zones are optional and limited
//! to a thousand.
//!
//! Gauges of cameras and their zones. A gauge vector of the registry identifies rows by a hash of
//! their concatenated label values, in which `a` and `bc` equal `ab` and `c`. So these rows are
//! collected from a map.

use std::{
    collections::{BTreeMap, HashMap},
    sync::Arc,
};

use lookdown_common::{
    metric_set,
    metrics::{Kind, text},
};
use lookdown_detect::metrics::DetectMetrics;
use lookdown_tracking::taught::NumberWithBar;
use parking_lot::Mutex;
use prometheus::{
    Error, HistogramVec, IntCounterVec, IntGaugeVec, Registry,
    core::{Collector, Desc},
    process_collector::ProcessCollector,
    proto::{Gauge, LabelPair, Metric, MetricFamily, MetricType},
};

pub use prometheus::{IntCounter, IntGauge};

metric_set! {
    /// The metrics of one server.
    pub struct Metrics {
        registry: Registry,
        /// Separate, as its names have no prefix.
        process: Registry,
        /// The metrics of detection.
        pub detect: Arc<DetectMetrics>,
    }

    /// Open connections, including those of the metrics port.
    connections: IntGauge = "connections" [];
    /// HTTP requests answered.
    http_requests: IntCounterVec = "http_requests_total" ["route", "method", "status"];
    /// Time from the head of an HTTP request to the head of its response.
    http_request_duration: HistogramVec = "http_request_duration_seconds" ["route", "method"];
    /// Time from a complete frame in memory to its report, for frames that got a report.
    request_duration: HistogramVec = "request_duration_seconds" ["model", "profile"];
    /// Time spent waiting for a worker and for the network.
    queue_duration: HistogramVec = "queue_duration_seconds" ["model", "profile"];
    /// Time from a frame's bytes to the input of the network.
    compute_input_duration: HistogramVec = "compute_input_duration_seconds" ["model", "profile"];
    /// Time in the network.
    compute_infer_duration: HistogramVec = "compute_infer_duration_seconds" ["model", "profile"];
    /// Time from the output of the network to persons in the frame.
    compute_output_duration: HistogramVec = "compute_output_duration_seconds" ["model", "profile"];
    /// Views that ran through the network, of frames that got a report.
    views: IntCounter = "views_total" [];
    /// Views skipped because nothing had moved in them, of frames that got a report.
    unchanged_views: IntCounter = "unchanged_views_total" [];
    /// Runs of the network for frames that got a report.
    batches: IntCounter = "batches_total" [];
    /// Candidates of the network that were dropped because they hold a number that is not finite.
    non_finite: IntCounter = "non_finite_candidates_total" [];
    /// Persons reported.
    persons: IntCounter = "persons_total" [];
    /// Persons that a camera sees now, as in `GET /results`; only with `results.camera_metrics`.
    camera_persons: CameraGauges = "camera_persons" ["camera"];
    /// Lower end of the error bar of `camera_persons`, which holds in 90 % of frames.
    camera_persons_low: CameraGauges = "camera_persons_low" ["camera"];
    /// Upper end of the error bar of `camera_persons`.
    camera_persons_high: CameraGauges = "camera_persons_high" ["camera"];
    /// Time of a camera's latest report, seconds since 1970; only with `results.camera_metrics`.
    camera_last_report: CameraGauges = "camera_last_report_timestamp_seconds" ["camera"];
    /// Persons in a zone in the latest frame of a camera; only with `calibrations.zone_metrics`.
    zone_persons: CameraGauges = "zone_persons" ["camera", "zone"];
    /// Requests answered with a problem, by its kind.
    failures: IntCounterVec = "request_failures_total" ["reason"];
    /// Frames that wait for a worker or are being processed.
    pending_frames: IntGauge = "pending_frames" [];
    /// Seconds since the last progress of a frame; 0 without frames.
    seconds_without_progress: IntGauge = "seconds_without_progress" [];
    /// Calibrations in use.
    calibrations: IntGauge = "calibrations" [];
    /// Always 1; the label identifies the set of calibrations in use, and is equal for equal sets.
    calibrations_info: IntGaugeVec = "calibrations_info" ["revision"];
    /// Calibration files whose newest version, or a camera of it, is invalid.
    calibration_files_broken: IntGauge = "calibration_files_broken" [];
    /// Calibration files read, by result.
    calibration_loads: IntCounterVec = "calibration_loads_total" ["result"];
    /// 1 when the calibration store can be read, else 0.
    calibration_store_up: IntGauge = "calibration_store_up" [];
    /// Cameras with a stored report.
    results_cameras: IntGauge = "results_cameras" [];
    /// Stored reports.
    results_reports: IntGauge = "results_reports" [];
    /// Memory of stored reports, bytes.
    results_bytes: IntGauge = "results_bytes" [];
    /// Cameras with a stored image.
    results_images: IntGauge = "results_images" [];
    /// Reports of this server that were stored.
    results_stored: IntCounter = "results_stored_total" [];
    /// Reports of this server that wait to be stored.
    results_waiting: IntGauge = "results_waiting" [];
    /// Reports of this server that were not stored: too many waited, or the result store refused
    /// them.
    results_dropped: IntCounter = "results_dropped_total" [];
    /// 1 when the result store can be reached, else 0.
    results_store_up: IntGauge = "results_store_up" [];
    /// Listeners to reports: event streams, and requests that wait for a newer report.
    results_listeners: IntGauge = "results_listeners" [];
    /// Listeners dropped because they did not keep up.
    results_listeners_dropped: IntCounter = "results_listeners_dropped_total" [];
    /// 1 while there is a connection to the MQTT broker, else 0.
    mqtt_connected: IntGauge = "mqtt_connected" [];
    /// Reports published to the MQTT broker.
    mqtt_reports_sent: IntCounter = "mqtt_reports_sent_total" [];
    /// Reports not published: the MQTT broker was unreachable or too slow, or the camera exceeds
    /// the limit.
    mqtt_reports_dropped: IntCounter = "mqtt_reports_dropped_total" [];
    /// Expiry of the server's TLS certificate, seconds since 1970; only with TLS.
    tls_certificate_expiry: IntGaugeVec = "tls_certificate_expiry_timestamp_seconds" [];
    /// Changes of the TLS files, by result.
    tls_certificate_loads: IntCounterVec = "tls_certificate_loads_total" ["result"];
    /// Finished TLS handshakes, by result.
    tls_handshakes: IntCounterVec = "tls_handshakes_total" ["result"];
    /// Always 1; the labels are the version of the server, and the commit if it is known.
    build_info: IntGaugeVec = "build_info" ["version", "commit"];
}

impl Default for Metrics {
    /// Creates metrics that are all zero.
    ///
    /// # Panics
    /// Never: names and labels are constants, which the tests register.
    #[expect(clippy::expect_used, reason = "names and labels are constants")]
    fn default() -> Self {
        let metrics = Self::registered().expect("valid names and labels");
        metrics.set_build(None);
        metrics
    }
}

impl Metrics {
    fn registered() -> Result<Self, prometheus::Error> {
        let registry = Registry::new_custom(Some("lookdown".to_owned()), None)?;
        let process = Registry::new();
        process.register(Box::new(ProcessCollector::for_self()))?;
        let detect = Arc::new(DetectMetrics::registered_in(&registry)?);
        Self::registered_with(&registry.clone(), registry, process, detect)
    }

    /// Sets the version of the server, and the commit from which it was built, if known.
    pub fn set_build(&self, commit: Option<&str>) {
        let labels = [env!("CARGO_PKG_VERSION"), commit.unwrap_or_default()];
        self.build_info.reset();
        self.build_info.with_label_values(&labels).set(1);
    }

    /// Sets the number of persons in the zones (each by its name) of a camera's latest frame. At
    /// most a thousand zones are published.
    pub fn set_zones<'a>(&self, camera: &str, zones: impl IntoIterator<Item = (&'a str, usize)>) {
        let zones = zones.into_iter();
        let rows = zones.map(|(zone, persons)| (Some(zone), count(persons)));
        self.zone_persons.replace(camera, rows);
    }

    /// Sets the number of persons of a camera with its bar, and the time of its latest report,
    /// seconds since 1970. At most a thousand cameras are published.
    pub fn set_camera(&self, camera: &str, number: NumberWithBar, reported_at: f64) {
        for (gauges, persons) in [
            (&self.camera_persons, number.persons),
            (&self.camera_persons_low, number.low),
            (&self.camera_persons_high, number.high),
        ] {
            gauges.replace(camera, [(None, count(persons))]);
        }
        let row = [(None, reported_at)];
        self.camera_last_report.replace(camera, row);
    }

    /// Removes the metrics of all other cameras.
    pub fn retain_cameras(&self, cameras: &[String]) {
        for gauges in [
            &self.camera_persons,
            &self.camera_persons_low,
            &self.camera_persons_high,
            &self.camera_last_report,
            &self.zone_persons,
        ] {
            gauges.retain(cameras);
        }
    }

    /// Returns all metrics in the Prometheus text format.
    ///
    /// # Errors
    /// If a metric cannot be written.
    pub fn render(&self) -> Result<String, prometheus::Error> {
        text(&[&self.registry, &self.process])
    }
}

fn count(persons: usize) -> f64 {
    u32::try_from(persons).unwrap_or(u32::MAX).into()
}

/// Most rows of one metric.
const MAX_ROWS: usize = 1000;

/// A gauge whose first label is the name of a camera. Clones share the rows.
#[derive(Debug, Clone)]
struct CameraGauges {
    desc: Desc,
    labels: Vec<String>,
    rows: Rows,
}

/// The values by camera and the other labels.
type Rows = Arc<Mutex<BTreeMap<(String, Vec<String>), f64>>>;

impl CameraGauges {
    /// Replaces the rows of a camera, each with the values of its other labels, unless there are
    /// too many rows.
    fn replace<'a>(&self, camera: &str, values: impl IntoIterator<Item = (Option<&'a str>, f64)>) {
        let mut rows = self.rows.lock();
        rows.retain(|(known, _), _| known != camera);
        for (label, value) in values {
            if rows.len() < MAX_ROWS {
                let labels = label.into_iter().map(ToOwned::to_owned).collect();
                rows.insert((camera.to_owned(), labels), value);
            }
        }
    }

    /// Removes the rows of all other cameras.
    fn retain(&self, cameras: &[String]) {
        let mut rows = self.rows.lock();
        rows.retain(|(camera, _), _| cameras.contains(camera));
    }
}

impl Kind for CameraGauges {
    fn create(name: &str, help: &str, labels: &[&str]) -> Result<Self, Error> {
        let labels: Vec<String> = labels.iter().map(|&label| label.to_owned()).collect();
        let names = labels.clone();
        let desc = Desc::new(name.to_owned(), help.to_owned(), names, HashMap::default())?;
        Ok(Self {
            desc,
            labels,
            rows: Rows::default(),
        })
    }
}

impl Collector for CameraGauges {
    fn desc(&self) -> Vec<&Desc> {
        vec![&self.desc]
    }

    fn collect(&self) -> Vec<MetricFamily> {
        let rows = self.rows.lock();
        let metrics = rows.iter().map(|((camera, others), value)| {
            let pair = |(name, value): (&String, &String)| {
                let mut pair = LabelPair::default();
                pair.set_name(name.clone());
                pair.set_value(value.clone());
                pair
            };
            let values = [camera].into_iter().chain(others);
            let mut gauge = Gauge::default();
            gauge.set_value(*value);
            let mut metric = Metric::from_gauge(gauge);
            metric.set_label(self.labels.iter().zip(values).map(pair).collect());
            metric
        });
        let mut family = MetricFamily::default();
        family.set_name(self.desc.fq_name.clone());
        family.set_help(self.desc.help.clone());
        family.set_field_type(MetricType::GAUGE);
        family.set_metric(metrics.collect());
        vec![family]
    }
}

#[cfg(test)]
mod tests;
