//! Every metric of the server: one struct with its own registry. The doc comment of a field is its
//! help text. Label values come from short fixed lists, never from clients. The labels of zones,
//! which administrators name, are optional and limited to a thousand.

mod kind;
mod zone_persons;

use std::{collections::BTreeSet, time::Duration};

use parking_lot::{Mutex, MutexGuard};
use prometheus::{
    Encoder, HistogramVec, IntCounter, IntCounterVec, IntGauge, IntGaugeVec, Registry, TextEncoder,
    process_collector::ProcessCollector,
};

use kind::Kind;
use zone_persons::ZonePersons;

/// Declares the struct, and registers each field as `lookdown_` followed by its name.
macro_rules! metrics {
    ($($(#[doc = $help:literal])+ $field:ident: $kind:ty = $name:literal [$($label:literal),*];)+) => {
        /// The metrics of one server.
        pub struct Metrics {
            registry: Registry,
            /// Separate, as its names have no prefix.
            process: Registry,
            shown: Mutex<Shown>,
            $($(#[doc = $help])+ pub $field: $kind,)+
        }

        impl Metrics {
            fn registered() -> Result<Self, prometheus::Error> {
                let registry = Registry::new_custom(Some("lookdown".to_owned()), None)?;
                $(
                    let help = concat!($($help),+).trim_start();
                    let $field = <$kind as Kind>::create($name, help, &[$($label),*])?;
                    registry.register(Box::new($field.clone()))?;
                )+
                let (process, shown) = (Registry::new(), Mutex::default());
                Ok(Self { registry, process, shown, $($field,)+ })
            }
        }
    };
}

metrics! {
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
    /// Persons in a zone of a calibration, latest frame; only with `calibrations.zone_metrics`.
    zone_persons: ZonePersons = "zone_persons" ["calibration", "zone"];
    /// Requests answered with a problem, by its kind.
    failures: IntCounterVec = "request_failures_total" ["reason"];
    /// Frames that wait for a worker or are being processed.
    pending_frames: IntGauge = "pending_frames" [];
    /// Frames dropped because their client had disconnected.
    withdrawn_frames: IntCounter = "withdrawn_frames_total" [];
    /// Seconds since the last progress of a frame; 0 without frames.
    seconds_without_progress: IntGauge = "seconds_without_progress" [];
    /// Stalls: no frame progressed for twice `server.request_timeout_millis`.
    worker_stalls: IntCounter = "worker_stalls_total" [];
    /// Always 1; the labels are the loaded models.
    model_info: IntGaugeVec = "model_info" ["model", "revision"];
    /// Model loads, by result.
    model_loads: IntCounterVec = "model_loads_total" ["result"];
    /// 1 while the inference server answers, else 0; only with an inference server.
    remote_up: IntGaugeVec = "remote_up" [];
    /// Requests to the inference server, by result; only with an inference server.
    remote_requests: IntCounterVec = "remote_requests_total" ["result"];
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
    /// Cameras with remap tables in memory, one per profile and frame size.
    rig_cache_rigs: IntGauge = "rig_cache_rigs" [];
    /// Memory of remap tables, bytes.
    rig_cache_bytes: IntGauge = "rig_cache_bytes" [];
    /// Builds of remap tables.
    rig_cache_builds: IntCounter = "rig_cache_builds_total" [];
    /// Remap tables evicted from memory.
    rig_cache_evictions: IntCounter = "rig_cache_evictions_total" [];
    /// Frames answered from the inference cache.
    inference_cache_hits: IntCounter = "recalled_frames_total" [];
    /// Cameras with a stored report.
    results_cameras: IntGauge = "results_cameras" [];
    /// Stored reports.
    results_reports: IntGauge = "results_reports" [];
    /// Memory of stored reports, bytes.
    results_bytes: IntGauge = "results_bytes" [];
    /// Cameras with a stored image.
    results_pictures: IntGauge = "results_pictures" [];
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

/// The rows of info metrics, which are removed when they are no longer true. The lock is held while
/// a scrape updates them: a concurrent one would add the same.
#[derive(Default)]
struct Shown {
    /// Model name and revision.
    models: BTreeSet<(String, String)>,
    calibrations: String,
}

impl Metrics {
    /// Creates metrics that are all zero.
    ///
    /// # Errors
    /// If Prometheus does not accept a name or a label.
    pub fn new() -> Result<Self, prometheus::Error> {
        let metrics = Self::registered()?;
        metrics
            .process
            .register(Box::new(ProcessCollector::for_self()))?;
        metrics.show_build(None);
        Ok(metrics)
    }

    /// Shows the version of the server, and the commit from which it was built, if known.
    pub fn show_build(&self, commit: Option<&str>) {
        let labels = [env!("CARGO_PKG_VERSION"), commit.unwrap_or_default()];
        self.build_info.reset();
        self.build_info.with_label_values(&labels).set(1);
    }

    /// Sets the number of frames that wait or are processed, and the number dropped since the
    /// start.
    pub fn show_frames(&self, pending: usize, withdrawn: u64) {
        let _one_scrape = self.one_scrape();
        self.pending_frames.set(count(pending));
        raise_to(&self.withdrawn_frames, withdrawn);
    }

    /// Sets the time since the last progress of a frame, and the number of stalls since the start.
    pub fn show_progress(&self, quiet_for: Duration, stalls: u64) {
        let _one_scrape = self.one_scrape();
        let seconds = i64::try_from(quiet_for.as_secs()).unwrap_or(i64::MAX);
        self.seconds_without_progress.set(seconds);
        raise_to(&self.worker_stalls, stalls);
    }

    /// Sets the loaded models, each by name and revision, and the number of loads since the start,
    /// by result.
    pub fn show_models(&self, models: &[(&str, &str)], loads: &[(&str, u64)]) {
        let mut shown = self.one_scrape();
        shown.models.retain(|(name, revision)| {
            let stays = models.contains(&(name, revision));
            if !stays {
                // The row exists, so it can be removed.
                let _ = self.model_info.remove_label_values(&[name, revision]);
            }
            stays
        });
        for (name, revision) in models {
            self.model_info.with_label_values(&[name, revision]).set(1);
            shown
                .models
                .insert(((*name).to_owned(), (*revision).to_owned()));
        }
        raise(&self.model_loads, loads);
    }

    /// Sets the state of the inference server, and the number of requests since the start, by
    /// result.
    pub fn show_remote(&self, up: bool, requests: &[(&str, u64)]) {
        let _one_scrape = self.one_scrape();
        let none: [&str; 0] = [];
        self.remote_up.with_label_values(&none).set(i64::from(up));
        raise(&self.remote_requests, requests);
    }

    /// Sets the number of calibrations in use, the revision of all of them, the number of invalid
    /// files, the state of their store, and the number of loads since the start, by result.
    pub fn show_calibrations(
        &self,
        serving: usize,
        revision: &str,
        broken: usize,
        up: bool,
        loads: &[(&str, u64)],
    ) {
        let mut shown = self.one_scrape();
        if shown.calibrations != revision {
            // There is no row before the first scrape.
            let _ = self
                .calibrations_info
                .remove_label_values(&[&shown.calibrations]);
            revision.clone_into(&mut shown.calibrations);
        }
        self.calibrations_info.with_label_values(&[revision]).set(1);
        self.calibrations.set(count(serving));
        self.calibration_files_broken.set(count(broken));
        self.calibration_store_up.set(i64::from(up));
        raise(&self.calibration_loads, loads);
    }

    /// Sets the number of persons in the zones (each by its name) of a calibration's latest frame.
    /// At most a thousand zones are published.
    pub fn show_zones<'a>(
        &self,
        calibration: &str,
        zones: impl IntoIterator<Item = (&'a str, usize)>,
    ) {
        for (zone, persons) in zones {
            self.zone_persons.set(calibration, zone, persons);
        }
    }

    /// Removes the zones for which `is_kept` is false, by calibration and name.
    pub fn retain_zones(&self, is_kept: impl Fn(&str, &str) -> bool) {
        self.zone_persons.retain(is_kept);
    }

    /// Sets the number and the bytes of rigs in memory, and the numbers built and evicted since the
    /// start.
    pub fn show_rig_cache(&self, rigs: usize, bytes: usize, builds: u64, evictions: u64) {
        let _one_scrape = self.one_scrape();
        self.rig_cache_rigs.set(count(rigs));
        self.rig_cache_bytes.set(count(bytes));
        raise_to(&self.rig_cache_builds, builds);
        raise_to(&self.rig_cache_evictions, evictions);
    }

    /// Sets the number of frames answered from the inference cache since the start.
    pub fn show_recalled(&self, frames: u64) {
        let _one_scrape = self.one_scrape();
        raise_to(&self.inference_cache_hits, frames);
    }

    /// Sets the numbers of stored cameras, reports, bytes and images.
    pub fn show_results(&self, cameras: usize, reports: usize, bytes: usize, pictures: usize) {
        let _one_scrape = self.one_scrape();
        self.results_cameras.set(count(cameras));
        self.results_reports.set(count(reports));
        self.results_bytes.set(count(bytes));
        self.results_pictures.set(count(pictures));
    }

    /// Sets the state of the result store, the number of reports that wait, and the numbers stored
    /// and dropped since the start.
    pub fn show_result_store(&self, up: bool, waiting: usize, stored: u64, dropped: u64) {
        let _one_scrape = self.one_scrape();
        self.results_store_up.set(i64::from(up));
        self.results_waiting.set(count(waiting));
        raise_to(&self.results_stored, stored);
        raise_to(&self.results_dropped, dropped);
    }

    /// Sets the number of listeners, and the number dropped since the start.
    pub fn show_listeners(&self, listeners: usize, dropped: u64) {
        let _one_scrape = self.one_scrape();
        self.results_listeners.set(count(listeners));
        raise_to(&self.results_listeners_dropped, dropped);
    }

    /// Returns all metrics in the Prometheus text format.
    ///
    /// # Errors
    /// If a metric cannot be written.
    pub fn render(&self) -> Result<String, prometheus::Error> {
        let mut text = Vec::new();
        for registry in [&self.registry, &self.process] {
            TextEncoder::new().encode(&registry.gather(), &mut text)?;
        }
        Ok(String::from_utf8_lossy(&text).into_owned())
    }

    fn one_scrape(&self) -> MutexGuard<'_, Shown> {
        // The next scrape corrects the rows.
        self.shown.lock()
    }
}

/// Raises counters to these counts.
fn raise(counters: &IntCounterVec, counts: &[(&str, u64)]) {
    for (result, count) in counts {
        raise_to(&counters.with_label_values(&[result]), *count);
    }
}

fn raise_to(counter: &IntCounter, count: u64) {
    counter.inc_by(count.saturating_sub(counter.get()));
}

fn count(count: usize) -> i64 {
    i64::try_from(count).unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests;
