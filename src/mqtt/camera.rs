//! The published state of one camera: counts and occupancy of its latest report, and availability.

use std::time::Duration;

use lookdown_tracking::taught::NumberWithBar;
use serde::Deserialize;
use serde_json::json;
use tokio::time::Instant;

use super::{
    discovery::{Discovery, OFFLINE, ONLINE, part_withdrawal, withdrawal},
    occupancy::Occupancy,
    session::Message,
    topics::{self, Topics},
};
use crate::{results::NewReport, views::StoredViews};

/// The times after which states change without a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Delays {
    /// Time without a person until occupancy is off.
    pub(super) hold: Duration,
    /// Time without a report until a camera is unavailable; `None` for never.
    pub(super) expire: Option<Duration>,
}

/// A camera with a report.
#[derive(Debug)]
pub(super) struct Camera {
    pub(super) name: String,
    /// The headline number.
    number: NumberWithBar,
    /// The number of its latest frame.
    frame_persons: usize,
    occupancy: Occupancy,
    zones: Vec<Zone>,
    /// The views whose images are published.
    views: StoredViews,
    attributes: Attributes,
    /// The time at which it becomes unavailable.
    pub(super) expires_at: Option<Instant>,
    pub(super) is_available: bool,
}

#[derive(Debug)]
struct Zone {
    name: String,
    persons: usize,
    occupancy: Occupancy,
}

/// The attributes of its entities: what a report was made with. They are published with the bar of
/// the number. Nothing in them changes with each frame, because Home Assistant records every change
/// of an attribute.
#[derive(Debug, Default, PartialEq, Eq)]
struct Attributes {
    calibration: Option<String>,
    model: Option<String>,
    profile: Option<String>,
}

/// The changes by a report.
pub(super) struct Changes {
    /// The removed zones, as parts of topics.
    pub(super) removed_zones: Vec<String>,
    /// True if there are other entities than before.
    pub(super) entities: bool,
    /// True if the attributes are others than before.
    pub(super) attributes: bool,
}

/// The parts of a report's JSON that are read.
#[derive(Default, Deserialize)]
struct ReportParts {
    #[serde(default)]
    zones: Vec<ZoneCount>,
    calibration: Option<CalibrationPart>,
    model: Option<ModelPart>,
    profile: Option<String>,
}

#[derive(Deserialize)]
struct CalibrationPart {
    id: String,
}

#[derive(Deserialize)]
struct ModelPart {
    name: String,
}

#[derive(Deserialize)]
struct ZoneCount {
    name: String,
    persons: usize,
}

impl Camera {
    /// A camera without a report, which is unavailable.
    pub(super) fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            number: NumberWithBar::untaught(0),
            frame_persons: 0,
            occupancy: Occupancy::default(),
            zones: Vec::new(),
            views: StoredViews::new(),
            attributes: Attributes::default(),
            expires_at: None,
            is_available: false,
        }
    }

    /// Updates the state with a report of age `age` and the headline number after it.
    pub(super) fn update(
        &mut self,
        report: &NewReport,
        number: NumberWithBar,
        age: Duration,
        now: Instant,
        delays: &Delays,
    ) -> Changes {
        // Reports come from a server of this version or an earlier one, and are always JSON.
        let parts: ReportParts = serde_json::from_slice(&report.json).unwrap_or_default();
        let attributes = Attributes {
            calibration: parts.calibration.map(|calibration| calibration.id),
            model: parts.model.map(|model| model.name),
            profile: parts.profile,
        };
        let mut has_other_attributes = attributes != self.attributes;
        self.attributes = attributes;
        let counts = parts.zones;
        let mut earlier = std::mem::take(&mut self.zones);
        let names = earlier.iter().map(|zone| zone.name.as_str());
        let has_other_zones = !names.eq(counts.iter().map(|zone| zone.name.as_str()));
        for ZoneCount { name, persons } in counts {
            let known = earlier.iter().position(|zone| zone.name == name);
            let known = known.map(|index| earlier.swap_remove(index));
            let mut zone = known.unwrap_or(Zone {
                name,
                persons,
                occupancy: Occupancy::default(),
            });
            zone.persons = persons;
            zone.occupancy.update(persons, now, delays.hold);
            self.zones.push(zone);
        }
        self.frame_persons = report.persons;
        has_other_attributes |= self.set_number(number, now, delays);
        let rest = delays.expire.map(|expire| expire.saturating_sub(age));
        self.expires_at = rest.map(|rest| now + rest);
        self.is_available = rest != Some(Duration::ZERO);
        Changes {
            removed_zones: earlier
                .iter()
                .map(|zone| format!("zones/{}", zone.name))
                .collect(),
            entities: has_other_zones,
            attributes: has_other_attributes,
        }
    }

    /// Sets the headline number. Returns false if it is the same as before.
    pub(super) fn set_number(
        &mut self,
        number: NumberWithBar,
        now: Instant,
        delays: &Delays,
    ) -> bool {
        let is_changed = self.number != number;
        self.number = number;
        self.occupancy.update(number.persons, now, delays.hold);
        is_changed
    }

    /// Changes what has changed by now without a report. Returns the messages.
    pub(super) fn expire(&mut self, now: Instant, topics: &Topics) -> Vec<Message> {
        let mut messages = Vec::new();
        if self.occupancy.expire(now) {
            messages.push(self.occupancy_message(topics));
        }
        for zone in &mut self.zones {
            if zone.occupancy.expire(now) {
                messages.push(zone.occupancy_message(&self.name, topics));
            }
        }
        let is_expired = self.expires_at.is_some_and(|expires_at| expires_at <= now);
        if self.is_available && is_expired {
            self.is_available = false;
            messages.push(self.availability(topics));
        }
        messages
    }

    /// Makes it unavailable until its next report. Returns the messages.
    pub(super) fn end(&mut self, now: Instant, topics: &Topics) -> Vec<Message> {
        self.expires_at = Some(now);
        self.expire(now, topics)
    }

    /// The time of the next change without a report.
    pub(super) fn next_change(&self) -> Option<Instant> {
        let expiry = self.expires_at.filter(|_| self.is_available);
        let zones = self.zones.iter().filter_map(|zone| zone.occupancy.off_at);
        let others = expiry.into_iter().chain(self.occupancy.off_at);
        zones.chain(others).min()
    }

    /// Sets the views whose images are published. Returns the messages: none without a change.
    pub(super) fn set_views(
        &mut self,
        views: StoredViews,
        topics: &Topics,
        discovery: &Discovery,
    ) -> Vec<Message> {
        if self.views == views {
            return Vec::new();
        }
        let before = std::mem::replace(&mut self.views, views);
        let gone = before.keys().filter(|name| !self.views.contains_key(*name));
        let gone =
            gone.flat_map(|name| part_withdrawal(topics, &self.name, &format!("views/{name}")));
        let now = self.announced(topics, discovery);
        gone.chain(now).chain(self.view_messages(topics)).collect()
    }

    /// The stored values of its views.
    pub(super) fn view_messages(&self, topics: &Topics) -> Vec<Message> {
        let views = self.views.iter().map(|(name, view)| {
            let values = serde_json::to_string(view).unwrap_or_default();
            Message::retained(topics.view(&self.name, name), values)
        });
        views.collect()
    }

    /// Returns true if a zone or a view has this part of a topic.
    pub(super) fn has_part(&self, part: &str) -> bool {
        let mut zones = self.zones.iter();
        match part.split_once('/') {
            Some(("views", view)) => self.views.contains_key(view),
            Some((_, level)) => zones.any(|zone| topics::level(&zone.name) == level),
            None => false,
        }
    }

    /// The announcements of its entities.
    pub(super) fn announced(&self, topics: &Topics, discovery: &Discovery) -> Vec<Message> {
        let zones = self.zones.iter().map(|zone| zone.name.as_str());
        let views = self.views.keys().map(String::as_str);
        discovery.announcements(topics, &self.name, zones, views)
    }

    /// The current state.
    pub(super) fn state(&self, topics: &Topics) -> Vec<Message> {
        let camera = self.name.as_str();
        let count = |topic, persons: usize| Message::retained(topic, persons.to_string());
        let mut messages = vec![
            count(topics.of_camera(camera, "persons"), self.number.persons),
            count(
                topics.of_camera(camera, "frame_persons"),
                self.frame_persons,
            ),
            self.occupancy_message(topics),
        ];
        for zone in &self.zones {
            messages.push(count(topics.zone(camera, &zone.name), zone.persons));
            messages.push(zone.occupancy_message(camera, topics));
        }
        // The last one: entities become available with their new state.
        messages.push(self.availability(topics));
        messages
    }

    /// The attributes of all its entities.
    pub(super) fn attributes(&self, topics: &Topics) -> Message {
        let Attributes {
            calibration,
            model,
            profile,
        } = &self.attributes;
        let NumberWithBar { low, high, .. } = self.number;
        let attributes = json!({
            "calibration": calibration, "model": model, "profile": profile,
            "persons_low": low, "persons_high": high,
        });
        Message::retained(
            topics.of_camera(&self.name, "attributes"),
            attributes.to_string(),
        )
    }

    pub(super) fn availability(&self, topics: &Topics) -> Message {
        let status = if self.is_available { ONLINE } else { OFFLINE };
        Message::retained(topics.of_camera(&self.name, "availability"), status)
    }

    fn occupancy_message(&self, topics: &Topics) -> Message {
        Message::retained(
            topics.of_camera(&self.name, "occupancy"),
            self.occupancy.payload(),
        )
    }

    /// The messages that remove it from the broker and from Home Assistant.
    pub(super) fn withdrawal(&self, topics: &Topics) -> Vec<Message> {
        let zones = self.zones.iter().map(|zone| format!("zones/{}", zone.name));
        let views = self.views.keys().map(|view| format!("views/{view}"));
        withdrawal(topics, &self.name, zones.chain(views))
    }
}

impl Zone {
    fn occupancy_message(&self, camera: &str, topics: &Topics) -> Message {
        let topic = topics.zone_occupancy(camera, &self.name);
        Message::retained(topic, self.occupancy.payload())
    }
}
