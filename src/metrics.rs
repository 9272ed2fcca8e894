//! Every metric the server exposes: one struct with a registry of its own. A field's doc comment
//! is its help text. Labels come from short fixed lists, never from what a client sends.

mod kind;

use prometheus::{
    Encoder, HistogramVec, IntCounter, IntCounterVec, IntGauge, IntGaugeVec, Registry, TextEncoder,
};

use kind::Kind;

/// Declares the struct, and registers each field under `lookdown_` and its name.
macro_rules! metrics {
    ($($(#[doc = $help:literal])+ $field:ident: $kind:ty = $name:literal [$($label:literal),*];)+) => {
        /// The metrics of one server.
        pub struct Metrics {
            registry: Registry,
            $($(#[doc = $help])+ pub $field: $kind,)+
        }

        impl Metrics {
            /// Fresh metrics, all zero.
            ///
            /// # Errors
            /// When a name or a label is not one that Prometheus accepts.
            pub fn new() -> Result<Self, prometheus::Error> {
                let registry = Registry::new_custom(Some("lookdown".to_owned()), None)?;
                $(
                    let help = concat!($($help),+).trim_start();
                    let $field = <$kind as Kind>::create($name, help, &[$($label),*])?;
                    registry.register(Box::new($field.clone()))?;
                )+
                Ok(Self { registry, $($field,)+ })
            }
        }
    };
}

metrics! {
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
    /// Runs of the network for frames that got a report.
    batches: IntCounter = "batches_total" [];
    /// Persons reported.
    persons: IntCounter = "persons_total" [];
    /// Requests that were answered with a problem, by its kind.
    failures: IntCounterVec = "request_failures_total" ["reason"];
    /// Frames that wait for a worker or are worked on.
    pending_frames: IntGauge = "pending_frames" [];
    /// Always 1; says which version runs.
    build_info: IntGaugeVec = "build_info" ["version"];
}

impl Metrics {
    /// All metrics in the Prometheus text format.
    ///
    /// # Errors
    /// When a metric cannot be written.
    pub fn render(&self) -> Result<String, prometheus::Error> {
        let mut text = Vec::new();
        TextEncoder::new().encode(&self.registry.gather(), &mut text)?;
        Ok(String::from_utf8_lossy(&text).into_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_carries_the_prefix_and_every_metric_its_help() {
        let metrics = Metrics::new().unwrap();
        metrics.views.inc_by(24);
        metrics
            .queue_duration
            .with_label_values(&["m", "fast"])
            .observe(0.2);
        let text = metrics.render().unwrap();
        assert!(
            text.contains("# HELP lookdown_views_total Views the network has seen of frames that got a report.\n"),
            "{text}"
        );
        assert!(text.contains("\nlookdown_views_total 24\n"), "{text}");
        let bucket =
            "lookdown_queue_duration_seconds_bucket{model=\"m\",profile=\"fast\",le=\"0.25\"} 1";
        assert!(text.contains(bucket), "{text}");
    }
}
