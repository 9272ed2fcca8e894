//! The kinds of metrics, created through one trait.

use prometheus::{
    Error, HistogramOpts, HistogramVec, IntCounter, IntCounterVec, IntGauge, IntGaugeVec, Opts,
};

/// Upper bounds, seconds: from a very short stage of a frame to the longest wait of a request.
const DURATION_BUCKETS: [f64; 15] = [
    0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0,
];

/// A kind of metric.
pub trait Kind: Sized {
    /// Creates a metric with this name, help text and labels.
    ///
    /// # Errors
    /// If a name is none that Prometheus allows.
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

/// A histogram of durations, in seconds.
impl Kind for HistogramVec {
    fn create(name: &str, help: &str, labels: &[&str]) -> Result<Self, Error> {
        let options = HistogramOpts::new(name, help).buckets(DURATION_BUCKETS.to_vec());
        Self::new(options, labels)
    }
}
