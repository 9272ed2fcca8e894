//! The metrics of the companion.

use prometheus::{
    Encoder, IntCounter, IntCounterVec, IntGauge, IntGaugeVec, Opts, Registry, TextEncoder,
};

use crate::counter::Counter;

/// All metrics. Series of cameras follow the scenes, which are bounded.
pub(crate) struct Metrics {
    registry: Registry,
    pub(crate) connected: IntGauge,
    /// Open connections of clients.
    pub(crate) connections: IntGauge,
    pub(crate) reports: IntCounter,
    pub(crate) reports_skipped: IntCounterVec,
    position_resets: IntCounter,
    pub(crate) commits_failed: IntCounter,
    pub(crate) webhooks_delivered: IntCounter,
    pub(crate) webhooks_dropped: IntCounter,
    crossings: IntCounterVec,
    persons: IntGaugeVec,
    zone_persons: IntGaugeVec,
    zone_entries: IntCounterVec,
    zone_person_seconds: IntCounterVec,
    site_persons: IntGaugeVec,
    last_report: IntGaugeVec,
}

impl Metrics {
    pub(crate) fn new() -> Result<Self, prometheus::Error> {
        let registry = Registry::new();
        let name = |name: &str| format!("lookdown_count_{name}");
        let counter = |of: &str, help: &str| {
            let counter = IntCounter::new(name(of), help)?;
            registry.register(Box::new(counter.clone()))?;
            Ok::<_, prometheus::Error>(counter)
        };
        let gauges = |of: &str, help: &str, labels: &[&str]| {
            let gauges = IntGaugeVec::new(Opts::new(name(of), help), labels)?;
            registry.register(Box::new(gauges.clone()))?;
            Ok::<_, prometheus::Error>(gauges)
        };
        let connected = IntGauge::new(
            name("connected"),
            "1 while the stream of reports is open, else 0.",
        )?;
        registry.register(Box::new(connected.clone()))?;
        let connections = IntGauge::new(name("connections"), "Open connections of clients.")?;
        registry.register(Box::new(connections.clone()))?;
        let reports_skipped = IntCounterVec::new(
            Opts::new(
                name("reports_skipped_total"),
                "Reports that were not counted, by reason: malformed, out_of_order, repeated, too_many_cameras.",
            ),
            &["reason"],
        )?;
        registry.register(Box::new(reports_skipped.clone()))?;
        let counters = |of: &str, help: &str, labels: &[&str]| {
            let counters = IntCounterVec::new(Opts::new(name(of), help), labels)?;
            registry.register(Box::new(counters.clone()))?;
            Ok::<_, prometheus::Error>(counters)
        };
        Ok(Self {
            connected,
            connections,
            reports: counter("reports_total", "Counted reports.")?,
            reports_skipped,
            position_resets: counter(
                "position_resets_total",
                "Times that the IDs of the server went back.",
            )?,
            commits_failed: counter("commits_failed_total", "Failed transactions of the store.")?,
            webhooks_delivered: counter("webhooks_delivered_total", "Delivered messages.")?,
            webhooks_dropped: counter("webhooks_dropped_total", "Messages that were given up.")?,
            crossings: counters(
                "crossings_total",
                "Crossings of the line since the store was created.",
                &["camera", "line", "direction"],
            )?,
            persons: gauges("persons", "Persons now; absent while unknown.", &["camera"])?,
            zone_persons: gauges(
                "zone_persons",
                "Persons in the zone now; absent while unknown.",
                &["camera", "zone"],
            )?,
            zone_entries: counters(
                "zone_entries_total",
                "Entries into the zone since the store was created.",
                &["camera", "zone"],
            )?,
            zone_person_seconds: counters(
                "zone_person_seconds_total",
                "Time that persons spent in the zone since the store was created.",
                &["camera", "zone"],
            )?,
            site_persons: gauges(
                "site_persons",
                "Persons now; absent while unknown.",
                &["site"],
            )?,
            last_report: gauges(
                "last_report_timestamp_seconds",
                "Time of the last frame.",
                &["camera"],
            )?,
            registry,
        })
    }

    /// Returns all metrics in the text format of Prometheus.
    pub(crate) fn text(&self, counter: &Counter, now_ms: i64) -> Vec<u8> {
        let snapshot = counter.snapshot(now_ms);
        self.position_resets.reset();
        self.position_resets.inc_by(counter.position_resets());
        for counters in [
            &self.crossings,
            &self.zone_entries,
            &self.zone_person_seconds,
        ] {
            counters.reset();
        }
        for gauges in [
            &self.persons,
            &self.zone_persons,
            &self.site_persons,
            &self.last_report,
        ] {
            gauges.reset();
        }
        let number = |value: u64| i64::try_from(value).unwrap_or(i64::MAX);
        for camera in &snapshot.cameras {
            let name = camera.name.as_str();
            let last_report = self.last_report.with_label_values(&[name]);
            last_report.set(camera.last_report_ms.div_euclid(1000));
            if let Some(persons) = camera.persons {
                self.persons.with_label_values(&[name]).set(number(persons));
            }
            for line in &camera.lines {
                let labels = [name, line.line.as_str(), line.direction.as_str()];
                self.crossings
                    .with_label_values(&labels)
                    .inc_by(line.crossings);
            }
            for zone in &camera.zones {
                let labels = [name, zone.zone.as_str()];
                if let Some(persons) = zone.persons {
                    self.zone_persons
                        .with_label_values(&labels)
                        .set(number(persons));
                }
                self.zone_entries
                    .with_label_values(&labels)
                    .inc_by(zone.entries);
                let seconds = zone.person_ms / 1000;
                self.zone_person_seconds
                    .with_label_values(&labels)
                    .inc_by(seconds);
            }
        }
        for site in &snapshot.sites {
            if let Some(persons) = site.persons {
                self.site_persons
                    .with_label_values(&[&site.name])
                    .set(number(persons));
            }
        }
        let mut text = Vec::new();
        // Writing to memory does not fail.
        let _ = TextEncoder::new().encode(&self.registry.gather(), &mut text);
        text
    }
}
