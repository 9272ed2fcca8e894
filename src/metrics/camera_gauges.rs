//! The gauges of persons in zones. A gauge vector of the registry identifies rows by a hash of their
//! concatenated label values, in which `a` and `bc` equal `ab` and `c`. So these rows are collected
//! from a map.

use std::{
    collections::{BTreeMap, HashMap},
    sync::Arc,
};

use parking_lot::{Mutex, MutexGuard};
use prometheus::{
    Error,
    core::{Collector, Desc},
    proto::{Gauge, LabelPair, Metric, MetricFamily, MetricType},
};

use super::kind::Kind;

/// Most zones that are published.
pub(super) const MAX_ROWS: usize = 1000;

/// The number of persons in each zone of a calibration. Clones share the rows.
#[derive(Debug, Clone)]
pub struct ZonePersons {
    desc: Desc,
    labels: [String; 2],
    rows: Rows,
}

/// The persons by calibration and zone.
type Rows = Arc<Mutex<BTreeMap<(String, String), u32>>>;

impl ZonePersons {
    /// Sets the number of persons in a zone, unless too many zones are published.
    pub(super) fn set(&self, calibration: &str, zone: &str, persons: usize) {
        let mut rows = self.lock();
        let row = (calibration.to_owned(), zone.to_owned());
        if rows.len() < MAX_ROWS || rows.contains_key(&row) {
            rows.insert(row, u32::try_from(persons).unwrap_or(u32::MAX));
        }
    }

    /// Removes the zones for which `is_kept` is false.
    pub(super) fn retain(&self, is_kept: impl Fn(&str, &str) -> bool) {
        self.lock()
            .retain(|(calibration, zone), _| is_kept(calibration, zone));
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<(String, String), u32>> {
        self.rows.lock()
    }
}

impl Kind for ZonePersons {
    fn create(name: &str, help: &str, labels: &[&str]) -> Result<Self, Error> {
        let names: Vec<String> = labels.iter().map(|&label| label.to_owned()).collect();
        let labels = <[String; 2]>::try_from(names.clone())
            .map_err(|_| Error::Msg(format!("{name} needs two labels")))?;
        let desc = Desc::new(name.to_owned(), help.to_owned(), names, HashMap::default())?;
        Ok(Self {
            desc,
            labels,
            rows: Rows::default(),
        })
    }
}

impl Collector for ZonePersons {
    fn desc(&self) -> Vec<&Desc> {
        vec![&self.desc]
    }

    fn collect(&self) -> Vec<MetricFamily> {
        let rows = self.lock();
        let metrics = rows.iter().map(|((calibration, zone), persons)| {
            let pair = |(name, value): (&String, &String)| {
                let mut pair = LabelPair::default();
                pair.set_name(name.clone());
                pair.set_value(value.clone());
                pair
            };
            let values = [calibration, zone];
            let mut gauge = Gauge::default();
            gauge.set_value(f64::from(*persons));
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
