//! The retained topics that this client does not publish, such as those of a camera that was
//! removed while no server was connected. They are withdrawn some time after the connection, unless
//! another client publishes them.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    discovery::{config_withdrawals, view_withdrawal},
    session::Message,
    topics::Topics,
};

/// Most owners and parts that are noted. Further ones stay with the broker.
const MAX_NOTED: usize = 10_000;

/// The owners of the retained topics that were received, such as cameras, by the levels of their
/// topics, with their parts, such as zones.
#[derive(Debug, Default)]
pub(super) struct RetainedTopics {
    owners: BTreeMap<String, BTreeSet<String>>,
    noted: usize,
}

impl RetainedTopics {
    /// Notes the owner of a retained topic, with the part that the topic names. Returns true for
    /// the first topic of the owner.
    pub(super) fn note(&mut self, owner: &str, part: Option<&str>) -> bool {
        if self.noted >= MAX_NOTED {
            return false;
        }
        let is_new = !self.owners.contains_key(owner);
        let parts = self.owners.entry(owner.to_owned()).or_default();
        let is_new_part = part.is_some_and(|part| parts.insert(part.to_owned()));
        self.noted += usize::from(is_new || is_new_part);
        is_new
    }

    /// Forgets an owner that another client publishes.
    pub(super) fn keep(&mut self, owner: &str) {
        self.owners.remove(owner);
    }

    /// Returns the noted owners with their parts, and forgets them.
    pub(super) fn take(&mut self) -> BTreeMap<String, BTreeSet<String>> {
        std::mem::take(self).owners
    }
}

/// The messages that remove a camera from the broker and from Home Assistant, with these parts:
/// `zones/` or `views/` and a name. Names may be levels of topics.
pub(super) fn withdrawal(
    topics: &Topics,
    camera: &str,
    parts: impl IntoIterator<Item = String>,
) -> Vec<Message> {
    let of_camera = [
        "persons",
        "frame_persons",
        "occupancy",
        "attributes",
        "availability",
    ];
    let mut messages = config_withdrawals(topics, camera, None);
    let of_camera = of_camera.map(|topic| topics.of_camera(camera, topic));
    messages.extend(of_camera.map(Message::forget));
    for part in parts {
        messages.extend(part_withdrawal(topics, camera, &part));
    }
    messages
}

/// The messages that remove a zone or a view from the broker and from Home Assistant.
pub(super) fn part_withdrawal(topics: &Topics, camera: &str, part: &str) -> Vec<Message> {
    let zone = match part.split_once('/') {
        Some(("views", view)) => {
            let topic = topics.view(camera, view);
            let config = view_withdrawal(topics, camera, view);
            return config.into_iter().chain([Message::forget(topic)]).collect();
        }
        Some((_, zone)) => zone,
        None => part,
    };
    let mut messages = config_withdrawals(topics, camera, Some(zone));
    let of_zone = [
        topics.zone(camera, zone),
        topics.zone_occupancy(camera, zone),
    ];
    messages.extend(of_zone.map(Message::forget));
    messages
}
