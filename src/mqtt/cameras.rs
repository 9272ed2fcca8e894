//! The state of each camera that the broker is to have, and its changes by reports.

use std::{collections::BTreeMap, num::NonZeroUsize};

use serde::Deserialize;

use super::{
    discovery::{announcements, withdrawal},
    message::Message,
    topics::Topics,
};
use crate::results::StoredReport;

/// The published cameras, a bounded number of them.
pub(super) struct Cameras {
    topics: Topics,
    most: NonZeroUsize,
    known: BTreeMap<String, Counts>,
    /// True once the warning about further cameras was logged.
    has_warned: bool,
}

/// The persons in a camera's frame and in its zones.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Counts {
    persons: usize,
    zones: Vec<ZoneCount>,
}

/// The parts of a report's JSON that are read.
#[derive(Deserialize)]
struct Zones {
    #[serde(default)]
    zones: Vec<ZoneCount>,
}

#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
struct ZoneCount {
    name: String,
    persons: usize,
}

impl Cameras {
    pub(super) fn new(topics: Topics, most: NonZeroUsize) -> Self {
        Self {
            topics,
            most,
            known: BTreeMap::new(),
            has_warned: false,
        }
    }

    /// Updates the camera of a report. Returns the messages to publish: none for a camera beyond
    /// the limit.
    pub(super) fn hear(&mut self, report: &StoredReport) -> Vec<Message> {
        let report = &report.report;
        let camera = report.camera.as_str();
        let is_known = self.known.contains_key(camera);
        if !is_known && self.known.len() >= self.most.get() {
            if !self.has_warned {
                tracing::warn!(
                    most = self.most,
                    "more cameras than mqtt.max_cameras have sent frames: only the first are published"
                );
            }
            self.has_warned = true;
            return Vec::new();
        }
        // Reports come from this server and are always JSON.
        let zones = serde_json::from_slice(&report.json);
        let counts = Counts {
            persons: report.persons,
            zones: zones.map_or(Vec::new(), |Zones { zones }| zones),
        };
        let before = self.known.insert(camera.to_owned(), counts);
        let mut messages = Vec::new();
        let Some(counts) = self.known.get(camera) else {
            return messages;
        };
        if before
            .as_ref()
            .is_none_or(|before| !before.has_zones_of(counts))
        {
            for zone in before.iter().flat_map(|before| &before.zones) {
                if !counts.zones.iter().any(|there| there.name == zone.name) {
                    messages.extend(withdrawal(&self.topics, camera, &zone.name));
                    messages.push(Message::forget(self.topics.zone(camera, &zone.name)));
                }
            }
            messages.extend(counts.announced(&self.topics, camera));
        }
        messages.extend(counts.count_messages(&self.topics, camera));
        let json = report.json.clone();
        messages.push(Message::passing(self.topics.report(camera), json));
        messages
    }

    /// All messages that the broker is to retain.
    pub(super) fn all(&self) -> Vec<Message> {
        let known = self.known.iter();
        let messages = known.flat_map(|(camera, counts)| {
            let mut messages = counts.announced(&self.topics, camera);
            messages.extend(counts.count_messages(&self.topics, camera));
            messages
        });
        messages.collect()
    }
}

impl Counts {
    fn has_zones_of(&self, other: &Self) -> bool {
        let (own, other) = (self.zones.iter(), other.zones.iter());
        own.map(|zone| &zone.name).eq(other.map(|zone| &zone.name))
    }

    fn announced(&self, topics: &Topics, camera: &str) -> Vec<Message> {
        let zones = self.zones.iter().map(|zone| zone.name.as_str());
        announcements(topics, camera, zones)
    }

    fn count_messages(&self, topics: &Topics, camera: &str) -> Vec<Message> {
        let count = |topic, persons: usize| Message::retained(topic, persons.to_string());
        let zones = self.zones.iter();
        let zones = zones.map(|zone| count(topics.zone(camera, &zone.name), zone.persons));
        std::iter::once(count(topics.persons(camera), self.persons))
            .chain(zones)
            .collect()
    }
}

#[cfg(test)]
mod tests;
