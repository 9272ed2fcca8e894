//! Every metric the server exposes: one struct with a registry of its own. A field's doc comment
//! is its help text. Labels come from short fixed lists, never from what a client sends; those of
//! zones, which administrators name, are shown only when asked for, and a thousand at most.

mod kind;
mod process;

use std::{
    collections::BTreeSet,
    sync::{Mutex, MutexGuard, PoisonError},
};

use prometheus::{
    Encoder, HistogramVec, IntCounter, IntCounterVec, IntGauge, IntGaugeVec, Registry, TextEncoder,
};

use kind::Kind;
use process::Process;

/// Zones shown at most.
const MAX_ZONE_ROWS: usize = 1000;

/// Declares the struct, and registers each field under `lookdown_` and its name.
macro_rules! metrics {
    ($($(#[doc = $help:literal])+ $field:ident: $kind:ty = $name:literal [$($label:literal),*];)+) => {
        /// The metrics of one server.
        pub struct Metrics {
            registry: Registry,
            /// Apart, as its names have no prefix.
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
    /// Connections that are open, those of the metrics port included.
    connections: IntGauge = "connections" [];
    /// HTTP requests answered.
    http_requests: IntCounterVec = "http_requests_total" ["route", "method", "status"];
    /// From the head of an HTTP request to the head of its answer.
    http_request_duration: HistogramVec = "http_request_duration_seconds" ["route", "method"];
    /// From a whole frame in memory to its report; counts the frames that got one.
    request_duration: HistogramVec = "request_duration_seconds" ["model", "profile"];
    /// Waiting for a worker and for the network.
    queue_duration: HistogramVec = "queue_duration_seconds" ["model", "profile"];
    /// From a frame's bytes to the input of the network.
    compute_input_duration: HistogramVec = "compute_input_duration_seconds" ["model", "profile"];
    /// The network.
    compute_infer_duration: HistogramVec = "compute_infer_duration_seconds" ["model", "profile"];
    /// From the output of the network to persons in the frame.
    compute_output_duration: HistogramVec = "compute_output_duration_seconds" ["model", "profile"];
    /// Views the network has seen of frames that got a report.
    views: IntCounter = "views_total" [];
    /// Views not looked at because nothing had moved in them, of frames that got a report.
    unchanged_views: IntCounter = "unchanged_views_total" [];
    /// Runs of the network for frames that got a report.
    batches: IntCounter = "batches_total" [];
    /// Candidates of the network dropped because a number of theirs was not finite.
    non_finite: IntCounter = "non_finite_candidates_total" [];
    /// Persons reported.
    persons: IntCounter = "persons_total" [];
    /// Persons in a zone (`calibration/zone`), in its latest frame; shown only with `calibrations.zone_metrics`.
    zone_persons: IntGaugeVec = "zone_persons" ["zone"];
    /// Requests that were answered with a problem, by its kind.
    failures: IntCounterVec = "request_failures_total" ["reason"];
    /// Frames that wait for a worker or are worked on.
    pending_frames: IntGauge = "pending_frames" [];
    /// Frames given up because nobody waited for their report any more.
    withdrawn_frames: IntCounter = "withdrawn_frames_total" [];
    /// Always 1; says which models answer.
    model_info: IntGaugeVec = "model_info" ["model", "revision"];
    /// Models loaded, and models that were refused when they were to be.
    model_loads: IntCounterVec = "model_loads_total" ["result"];
    /// 1 when requests are sent to the inference server, 0 while it does not answer; shown only with one.
    remote_up: IntGaugeVec = "remote_up" [];
    /// Requests to the inference server by how they came out; shown only with one.
    remote_requests: IntCounterVec = "remote_requests_total" ["result"];
    /// Calibrations that serve.
    calibrations: IntGauge = "calibrations" [];
    /// Always 1; says which calibrations serve, all of them together: equal where equal ones do.
    calibrations_info: IntGaugeVec = "calibrations_info" ["revision"];
    /// Calibration files whose newest version, or a camera of it, cannot be used.
    calibration_files_broken: IntGauge = "calibration_files_broken" [];
    /// Calibration files read, by whether all of it could be used.
    calibration_loads: IntCounterVec = "calibration_loads_total" ["result"];
    /// 1 when the place of the calibrations could be looked at, else 0.
    calibration_store_up: IntGauge = "calibration_store_up" [];
    /// Cameras whose remap tables are in memory, one per profile and frame size.
    rig_cache_rigs: IntGauge = "rig_cache_rigs" [];
    /// Memory that remap tables hold, bytes.
    rig_cache_bytes: IntGauge = "rig_cache_bytes" [];
    /// Times that remap tables were built.
    rig_cache_builds: IntCounter = "rig_cache_builds_total" [];
    /// Times that remap tables were dropped to make room for others.
    rig_cache_evictions: IntCounter = "rig_cache_evictions_total" [];
    /// Frames that were not looked at again, as what was found in them was remembered.
    recalled_frames: IntCounter = "recalled_frames_total" [];
    /// Cameras of which a report is kept.
    results_cameras: IntGauge = "results_cameras" [];
    /// Reports that are kept.
    results_reports: IntGauge = "results_reports" [];
    /// Memory that kept reports take, bytes.
    results_bytes: IntGauge = "results_bytes" [];
    /// Cameras of which a picture is kept.
    results_pictures: IntGauge = "results_pictures" [];
    /// Reports of this server that were stored.
    results_stored: IntCounter = "results_stored_total" [];
    /// Reports of this server that wait to be stored.
    results_waiting: IntGauge = "results_waiting" [];
    /// Reports of this server that will not be stored: too many waited, or their place refused them.
    results_dropped: IntCounter = "results_dropped_total" [];
    /// 1 when the place of the results can be reached, else 0.
    results_store_up: IntGauge = "results_store_up" [];
    /// Who listens to reports: event streams, and requests that wait for a newer report.
    results_listeners: IntGauge = "results_listeners" [];
    /// Listeners given up because they did not keep up.
    results_listeners_dropped: IntCounter = "results_listeners_dropped_total" [];
    /// 1 while there is a connection to the MQTT broker, else 0.
    mqtt_connected: IntGauge = "mqtt_connected" [];
    /// Reports published to the MQTT broker.
    mqtt_reports_sent: IntCounter = "mqtt_reports_sent_total" [];
    /// Reports not published because the MQTT broker was away or too slow, or their camera one too many.
    mqtt_reports_dropped: IntCounter = "mqtt_reports_dropped_total" [];
    /// When the server's TLS certificate ends, seconds since 1970; shown only with TLS.
    tls_certificate_expiry: IntGaugeVec = "tls_certificate_expiry_timestamp_seconds" [];
    /// Times that the files of TLS were found changed, by whether what they hold can be used.
    tls_certificate_loads: IntCounterVec = "tls_certificate_loads_total" ["result"];
    /// TLS handshakes that came to an end, by how.
    tls_handshakes: IntCounterVec = "tls_handshakes_total" ["result"];
    /// Always 1; says which version runs.
    build_info: IntGaugeVec = "build_info" ["version"];
}

/// Rows of info metrics, which go when they are true no more. Its lock is held for as long as one
/// scrape shows something: another one would add the same.
#[derive(Default)]
struct Shown {
    /// Name and revision.
    models: BTreeSet<(String, String)>,
    calibrations: String,
    /// Calibration and zone.
    zones: BTreeSet<(String, String)>,
}

impl Metrics {
    /// Fresh metrics, all zero.
    ///
    /// # Errors
    /// When a name or a label is not one that Prometheus accepts.
    pub fn new() -> Result<Self, prometheus::Error> {
        let metrics = Self::registered()?;
        let version = [env!("CARGO_PKG_VERSION")];
        metrics.build_info.with_label_values(&version).set(1);
        metrics.process.register(Box::new(Process::new()?))?;
        Ok(metrics)
    }

    /// Shows how many frames wait for a worker or are worked on, and how many were given up since the start.
    pub fn show_frames(&self, pending: usize, withdrawn: u64) {
        let _one_scrape = self.one_scrape();
        self.pending_frames.set(count(pending));
        raise_to(&self.withdrawn_frames, withdrawn);
    }

    /// Shows these models, each by name and revision, and no others, and how many loads came out
    /// how since the start.
    pub fn show_models(&self, models: &[(&str, &str)], loads: &[(&str, u64)]) {
        let mut shown = self.one_scrape();
        shown.models.retain(|(name, revision)| {
            let stays = models.contains(&(name, revision));
            if !stays {
                // It was there, so it can be removed.
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

    /// Shows whether requests are sent to the inference server, and how many came out how since the
    /// start.
    pub fn show_remote(&self, up: bool, requests: &[(&str, u64)]) {
        let _one_scrape = self.one_scrape();
        let none: [&str; 0] = [];
        self.remote_up.with_label_values(&none).set(i64::from(up));
        raise(&self.remote_requests, requests);
    }

    /// Shows how many calibrations serve and the revision of all of them, how many files are broken,
    /// whether their store can be looked at, and how many loads came out how since the start.
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
            // Nothing is shown before the first scrape.
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

    /// Shows how many persons were in the zones (each by its name) of a calibration's latest frame.
    /// A thousand zones are shown, further ones are not.
    pub fn show_zones<'a>(
        &self,
        calibration: &str,
        zones: impl IntoIterator<Item = (&'a str, usize)>,
    ) {
        let mut shown = self.one_scrape();
        for (zone, persons) in zones {
            let row = (calibration.to_owned(), zone.to_owned());
            if shown.zones.len() < MAX_ZONE_ROWS || shown.zones.contains(&row) {
                let label = zone_label(calibration, zone);
                let gauge = self.zone_persons.with_label_values(&[label]);
                gauge.set(count(persons));
                shown.zones.insert(row);
            }
        }
    }

    /// Shows those zones no more that are not `there`, by calibration and name.
    pub fn retain_zones(&self, there: impl Fn(&str, &str) -> bool) {
        let mut shown = self.one_scrape();
        shown.zones.retain(|(calibration, zone)| {
            let stays = there(calibration, zone);
            if !stays {
                // It was there, so it can be removed.
                let label = zone_label(calibration, zone);
                let _ = self.zone_persons.remove_label_values(&[label]);
            }
            stays
        });
    }

    /// Shows how many rigs of how many bytes are in memory, and how many were built and evicted
    /// since the start.
    pub fn show_rig_cache(&self, rigs: usize, bytes: usize, builds: u64, evictions: u64) {
        let _one_scrape = self.one_scrape();
        self.rig_cache_rigs.set(count(rigs));
        self.rig_cache_bytes.set(count(bytes));
        raise_to(&self.rig_cache_builds, builds);
        raise_to(&self.rig_cache_evictions, evictions);
    }

    /// Shows how many frames were recalled since the start.
    pub fn show_recalled(&self, frames: u64) {
        let _one_scrape = self.one_scrape();
        raise_to(&self.recalled_frames, frames);
    }

    /// Shows how many reports of how many cameras and bytes are kept, and how many pictures.
    pub fn show_results(&self, cameras: usize, reports: usize, bytes: usize, pictures: usize) {
        let _one_scrape = self.one_scrape();
        self.results_cameras.set(count(cameras));
        self.results_reports.set(count(reports));
        self.results_bytes.set(count(bytes));
        self.results_pictures.set(count(pictures));
    }

    /// Shows whether reports can be stored, how many wait for it, and how many were stored and dropped
    /// since the start.
    pub fn show_result_store(&self, up: bool, waiting: usize, stored: u64, dropped: u64) {
        let _one_scrape = self.one_scrape();
        self.results_store_up.set(i64::from(up));
        self.results_waiting.set(count(waiting));
        raise_to(&self.results_stored, stored);
        raise_to(&self.results_dropped, dropped);
    }

    /// Shows how many listen, and how many were given up since the start.
    pub fn show_listeners(&self, listeners: usize, dropped: u64) {
        let _one_scrape = self.one_scrape();
        self.results_listeners.set(count(listeners));
        raise_to(&self.results_listeners_dropped, dropped);
    }

    /// All metrics in the Prometheus text format.
    ///
    /// # Errors
    /// When a metric cannot be written.
    pub fn render(&self) -> Result<String, prometheus::Error> {
        let mut text = Vec::new();
        for registry in [&self.registry, &self.process] {
            TextEncoder::new().encode(&registry.gather(), &mut text)?;
        }
        Ok(String::from_utf8_lossy(&text).into_owned())
    }

    fn one_scrape(&self) -> MutexGuard<'_, Shown> {
        // What is shown is put right by the next scrape.
        self.shown.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// One label for both: the registry tells rows apart by a hash of all their labels put together, in
/// which `a` and `bc` are `ab` and `c`. Neither name may have a slash.
fn zone_label(calibration: &str, zone: &str) -> String {
    format!("{calibration}/{zone}")
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
