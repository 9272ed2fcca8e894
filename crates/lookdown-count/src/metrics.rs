//! The metrics of the companion.

use lookdown_common::{metric_set, metrics::text};
use prometheus::{IntCounter, IntCounterVec, IntGauge, IntGaugeVec, Registry};

use crate::counter::Counter;

metric_set! {
    /// All metrics. Series of cameras follow the scenes, which are bounded.
    pub(crate) struct Metrics {
        registry: Registry,
    }

    /// 1 while the stream of reports is open, else 0.
    connected: IntGauge = "connected" [];
    /// Open connections of clients.
    connections: IntGauge = "connections" [];
    /// Counted reports.
    reports: IntCounter = "reports_total" [];
    /// Reports that were not counted, by reason: malformed, out_of_order, repeated,
    /// too_many_cameras.
    reports_skipped: IntCounterVec = "reports_skipped_total" ["reason"];
    /// Times that the IDs of the server went back.
    position_resets: IntCounter = "position_resets_total" [];
    /// Cameras that made room for others: there are more than `counts.max_cameras`.
    displaced_cameras: IntCounter = "displaced_cameras_total" [];
    /// Failed transactions of the store.
    commits_failed: IntCounter = "commits_failed_total" [];
    /// Delivered messages.
    webhooks_delivered: IntCounter = "webhooks_delivered_total" [];
    /// Messages that were given up.
    webhooks_dropped: IntCounter = "webhooks_dropped_total" [];
    /// Crossings of the line since the store was created.
    crossings: IntCounterVec = "crossings_total" ["camera", "line", "direction"];
    /// Persons now; absent while unknown.
    persons: IntGaugeVec = "persons" ["camera"];
    /// Persons in the zone now; absent while unknown.
    zone_persons: IntGaugeVec = "zone_persons" ["camera", "zone"];
    /// Entries into the zone since the store was created.
    zone_entries: IntCounterVec = "zone_entries_total" ["camera", "zone"];
    /// Time that persons spent in the zone since the store was created.
    zone_person_seconds: IntCounterVec = "zone_person_seconds_total" ["camera", "zone"];
    /// Persons now; absent while unknown.
    site_persons: IntGaugeVec = "site_persons" ["site"];
    /// 1 while crossings may be missed, as fewer frames than lines need became reports, else 0;
    /// absent while unknown or without lines.
    too_low: IntGaugeVec = "too_low" ["camera"];
    /// 1 while someone is on the floor and no user has acknowledged it, else 0; absent without
    /// `counts.floor_alert`.
    floor_alert: IntGaugeVec = "floor_alert" ["camera"];
    /// Time of the last frame.
    last_report: IntGaugeVec = "last_report_timestamp_seconds" ["camera"];
}

impl Metrics {
    pub(crate) fn new() -> Result<Self, prometheus::Error> {
        let registry = Registry::new_custom(Some("lookdown_count".to_owned()), None)?;
        Self::registered_with(&registry.clone(), registry)
    }

    /// Returns all metrics in the text format of Prometheus.
    pub(crate) fn text(&self, counter: &Counter, now_ms: i64) -> Vec<u8> {
        let snapshot = counter.snapshot(now_ms);
        for (metric, count) in [
            (&self.position_resets, counter.position_resets),
            (&self.displaced_cameras, counter.displaced_cameras),
        ] {
            metric.reset();
            metric.inc_by(count);
        }
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
            &self.too_low,
            &self.floor_alert,
            &self.last_report,
        ] {
            gauges.reset();
        }
        let set = |gauge: &IntGaugeVec, labels: &[&str], value: i64| {
            gauge.with_label_values(labels).set(value);
        };
        let add = |counter: &IntCounterVec, labels: &[&str], value: u64| {
            counter.with_label_values(labels).inc_by(value);
        };
        let number = |value: u64| i64::try_from(value).unwrap_or(i64::MAX);
        for camera in &snapshot.cameras {
            let name = camera.name.as_str();
            // No alert waits for the reports of a paused camera.
            if !camera.is_paused {
                let seconds = camera.last_report_ms.div_euclid(1000);
                set(&self.last_report, &[name], seconds);
            }
            if let Some(persons) = camera.persons {
                set(&self.persons, &[name], number(persons));
                if !camera.lines.is_empty() {
                    let is_too_low = camera.too_low_since_ms.is_some();
                    set(&self.too_low, &[name], is_too_low.into());
                }
            }
            if let Some(alerts) = &camera.floor_alerts {
                let is_open = alerts.iter().any(|alert| !alert.is_acknowledged);
                set(&self.floor_alert, &[name], is_open.into());
            }
            for line in &camera.lines {
                let labels = [name, line.line.as_str(), line.direction.as_str()];
                add(&self.crossings, &labels, line.crossings);
            }
            for zone in &camera.zones {
                let labels = [name, zone.zone.as_str()];
                if let Some(persons) = zone.persons {
                    set(&self.zone_persons, &labels, number(persons));
                }
                add(&self.zone_entries, &labels, zone.entries);
                let seconds = zone.person_ms / 1000;
                add(&self.zone_person_seconds, &labels, seconds);
            }
        }
        for site in &snapshot.sites {
            if let Some(persons) = site.persons {
                set(&self.site_persons, &[&site.name], number(persons));
            }
        }
        // Writing to memory does not fail.
        text(&[&self.registry]).unwrap_or_default().into_bytes()
    }
}
