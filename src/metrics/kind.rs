//! Kinds of metrics, created alike.

use prometheus::{
    Error, HistogramOpts, HistogramVec, IntCounter, IntCounterVec, IntGauge, IntGaugeVec, Opts,
};

/// Upper bounds, seconds: those OpenTelemetry recommends for the duration of HTTP requests.
const DURATION_BUCKETS: [f64; 14] = [
    0.005, 0.01, 0.025, 0.05, 0.075, 0.1, 0.25, 0.5, 0.75, 1.0, 2.5, 5.0, 7.5, 10.0,
];

/// A kind of metric.
pub(super) trait Kind: Sized {
    /// A metric with that name, help text and labels.
    fn create(name: &str, help: &str, labels: &[&str]) -> Result<Self, Error>;
}

impl Kind for IntCounter {
    fn create(name: &str, help: &str, _labels: &[&str]) -> Result<Self, Error> {
        Self::new(name, help)
    }
}

impl Kind for IntGauge {
    fn create(name: &str, help: &str, _labels: &[&str]) -> Result<Self, Error> {
        Self::new(name, help)
    }
}

impl Kind for IntCounterVec {
    fn create(name: &str, help: &str, labels: &[&str]) -> Result<Self, Error> {
        Self::new(Opts::new(name, help), labels)
    }
}

impl Kind for IntGaugeVec {
    fn create(name: &str, help: &str, labels: &[&str]) -> Result<Self, Error> {
        Self::new(Opts::new(name, help), labels)
    }
}

/// Durations, in seconds.
impl Kind for HistogramVec {
    fn create(name: &str, help: &str, labels: &[&str]) -> Result<Self, Error> {
        let options = HistogramOpts::new(name, help).buckets(DURATION_BUCKETS.to_vec());
        Self::new(options, labels)
    }
}
