//! Gauges of cameras and their zones. A gauge vector of the registry identifies rows by a hash of
//! their concatenated label values, in which `a` and `bc` equal `ab` and `c`. So these rows are
//! collected from a map.

use std::{
    collections::{BTreeMap, HashMap},
    sync::Arc,
};

use parking_lot::Mutex;
use prometheus::{
    Error,
    core::{Collector, Desc},
    proto::{Gauge, LabelPair, Metric, MetricFamily, MetricType},
};

use lookdown_common::metrics::Kind;

/// Most rows of one metric.
pub(super) const MAX_ROWS: usize = 1000;

/// A gauge whose first label is the name of a camera. Clones share the rows.
#[derive(Debug, Clone)]
pub struct CameraGauges {
    desc: Desc,
    labels: Vec<String>,
    rows: Rows,
}

/// The values by camera and the other labels.
type Rows = Arc<Mutex<BTreeMap<(String, Vec<String>), f64>>>;

impl CameraGauges {
    /// Replaces the rows of a camera, each with the values of its other labels, unless there are
    /// too many rows.
    pub(super) fn replace<'a>(
        &self,
        camera: &str,
        values: impl IntoIterator<Item = (Option<&'a str>, f64)>,
    ) {
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
    pub(super) fn retain(&self, cameras: &[String]) {
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
