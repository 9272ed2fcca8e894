//! The metrics of detection. The doc comment of a field is its help text. Each part of the engine
//! counts its own events in the struct, which its owner registers.

use lookdown_common::metric_set;
use prometheus::{HistogramVec, IntCounterVec, IntGaugeVec, Registry};
pub use prometheus::{IntCounter, IntGauge};

metric_set! {
    /// The metrics of one engine and its models.
    pub struct DetectMetrics {}

    /// Frames dropped because their client had disconnected.
    withdrawn_frames: IntCounter = "withdrawn_frames_total" [];
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
    /// Cameras with remap tables in memory, one per profile and frame size.
    rig_cache_rigs: IntGauge = "rig_cache_rigs" [];
    /// Memory of remap tables, bytes.
    rig_cache_bytes: IntGauge = "rig_cache_bytes" [];
    /// Builds of remap tables.
    rig_cache_builds: IntCounter = "rig_cache_builds_total" [];
    /// Remap tables evicted from memory.
    rig_cache_evictions: IntCounter = "rig_cache_evictions_total" [];
    /// Views in a batch for the network.
    batch_size: HistogramVec = "batch_size" [];
    /// Time from the queueing of the first view of a batch to its start.
    batch_wait: HistogramVec = "batch_wait_seconds" [];
    /// Frames, by the origin of their persons: `full`, `followed` or `unchanged`.
    frame_searches: IntCounterVec = "frame_searches_total" ["search"];
}

impl DetectMetrics {
    /// Creates metrics that are all zero, and registers them.
    ///
    /// # Errors
    /// If the registry has a metric of such a name.
    pub fn registered_in(registry: &Registry) -> Result<Self, prometheus::Error> {
        Self::registered_with(registry)
    }
}

impl Default for DetectMetrics {
    /// Creates metrics that are all zero, in a registry of their own.
    ///
    /// # Panics
    /// Never: names and labels are constants, which the tests register.
    #[expect(clippy::expect_used, reason = "names and labels are constants")]
    fn default() -> Self {
        Self::registered_in(&Registry::new()).expect("valid names and labels")
    }
}

/// Creates the rows of these results, at zero: an alert must see the first of each.
pub fn start_at_zero(counters: &IntCounterVec, results: &[&str]) {
    for result in results {
        counters.with_label_values(&[result]);
    }
}

/// Replaces the row of an info metric. A concurrent scrape sees one of them at least.
pub fn replace_info(info: &IntGaugeVec, before: Option<&[&str]>, now: &[&str]) {
    info.with_label_values(now).set(1);
    if let Some(before) = before.filter(|before| *before != now) {
        // There may be no such row yet.
        let _ = info.remove_label_values(before);
    }
}

/// Returns the value of a gauge that counts things.
pub fn gauge_value(count: impl TryInto<i64>) -> i64 {
    count.try_into().unwrap_or(i64::MAX)
}
