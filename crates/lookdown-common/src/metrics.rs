//! The declaration of metrics: `metric_set!` makes the struct and its registration from one list.

use prometheus::{
    Error, HistogramOpts, HistogramVec, IntCounter, IntCounterVec, IntGauge, Opts, Registry,
    TextEncoder,
    core::{Atomic, GenericGaugeVec},
};

/// Upper bounds, seconds: from a very short stage of a frame to the longest wait of a request.
const DURATION_BUCKETS: [f64; 15] = [
    0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0,
];

/// Upper bounds of counts: up to the greatest batch of views.
const COUNT_BUCKETS: [f64; 8] = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0];

/// Declares a struct of metrics with a constructor `registered_with`, which registers each metric
/// by its name and takes the values of the struct's other fields. The doc comment of a field is its
/// help text, and the visibility of the struct is that of its metrics. The crate needs
/// `prometheus`.
#[macro_export]
macro_rules! metric_set {
    (
        $(#[$about:meta])*
        $visibility:vis struct $set:ident {
            $($(#[$note:meta])* $other_visibility:vis $other:ident: $type:ty,)*
        }
        $($(#[doc = $help:literal])+ $field:ident: $kind:ty = $name:literal [$($label:literal),*];)+
    ) => {
        $(#[$about])*
        #[derive(Debug)]
        $visibility struct $set {
            $($(#[$note])* $other_visibility $other: $type,)*
            $($(#[doc = $help])+ $visibility $field: $kind,)+
        }

        impl $set {
            fn registered_with(
                registry: &prometheus::Registry,
                $($other: $type,)*
            ) -> Result<Self, prometheus::Error> {
                $(
                    let help = concat!($($help),+).trim_start();
                    let $field = <$kind as $crate::metrics::Kind>::create($name, help, &[$($label),*])?;
                    registry.register(Box::new($field.clone()))?;
                )+
                Ok(Self { $($other,)* $($field,)+ })
            }
        }
    };
}

/// Returns all metrics of the registries in the text format of Prometheus.
///
/// # Errors
/// If a metric cannot be written.
pub fn text(registries: &[&Registry]) -> Result<String, Error> {
    let families = registries.iter().flat_map(|registry| registry.gather());
    TextEncoder::new().encode_to_string(&families.collect::<Vec<_>>())
}

/// A kind of metric.
pub trait Kind: Sized {
    /// Creates a metric with this name, help text and labels.
    ///
    /// # Errors
    /// If a name is none that Prometheus allows.
    fn create(name: &str, help: &str, labels: &[&str]) -> Result<Self, Error>;
}

impl<P: Atomic> Kind for GenericGaugeVec<P> {
    fn create(name: &str, help: &str, labels: &[&str]) -> Result<Self, Error> {
        Self::new(Opts::new(name, help), labels)
    }
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

/// A histogram of durations if the name ends in `_seconds`, else of counts.
impl Kind for HistogramVec {
    fn create(name: &str, help: &str, labels: &[&str]) -> Result<Self, Error> {
        let buckets: &[f64] = if name.ends_with("_seconds") {
            &DURATION_BUCKETS
        } else {
            &COUNT_BUCKETS
        };
        let options = HistogramOpts::new(name, help).buckets(buckets.to_vec());
        Self::new(options, labels)
    }
}
