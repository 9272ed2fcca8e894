//! The retained topics of cameras that this server does not publish, such as those of a camera that
//! was removed while no server was connected. They are withdrawn some time after the connection,
//! unless another server publishes them.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    discovery::{OFFLINE, config_withdrawals},
    message::Message,
    topics::{CameraTopic, Topics},
};

/// Most zones and cameras that are noted. Further ones stay with the broker.
const MAX_NOTED: usize = 10_000;

/// The cameras whose retained topics were received, by the levels of their topics, with their
/// zones.
#[derive(Debug, Default)]
pub(super) struct RetainedTopics {
    cameras: BTreeMap<String, BTreeSet<String>>,
    noted: usize,
}

impl RetainedTopics {
    /// Notes a retained topic. Returns the message that makes an unknown camera unavailable, with
    /// its first topic.
    pub(super) fn note(
        &mut self,
        topic: &CameraTopic<'_>,
        is_known: bool,
        topics: &Topics,
    ) -> Option<Message> {
        if self.noted >= MAX_NOTED {
            return None;
        }
        let camera = topic.camera();
        let is_new = !self.cameras.contains_key(camera);
        let zones = self.cameras.entry(camera.to_owned()).or_default();
        let is_noted = match topic {
            CameraTopic::Zone { zone, .. } => zones.insert((*zone).to_owned()),
            CameraTopic::Persons { .. } | CameraTopic::Availability { .. } => is_new,
        };
        self.noted += usize::from(is_noted);
        let offline = || Message::retained(topics.availability(camera), OFFLINE);
        (is_new && !is_known).then(offline)
    }

    /// Forgets a camera that another server publishes.
    pub(super) fn keep(&mut self, camera: &str) {
        self.cameras.remove(camera);
    }

    /// Returns the noted cameras with their zones, and forgets them.
    pub(super) fn take(&mut self) -> BTreeMap<String, BTreeSet<String>> {
        std::mem::take(self).cameras
    }
}

/// The messages that remove a camera from the broker and from Home Assistant. Camera and zones are
/// names, or levels of topics.
pub(super) fn withdrawal(
    topics: &Topics,
    camera: &str,
    zones: impl IntoIterator<Item = String>,
) -> Vec<Message> {
    let of_camera = [
        topics.persons(camera),
        topics.occupancy(camera),
        topics.attributes(camera),
        topics.availability(camera),
    ];
    let mut messages = config_withdrawals(topics, camera, None);
    messages.extend(of_camera.map(Message::forget));
    for zone in zones {
        messages.extend(zone_withdrawal(topics, camera, &zone));
    }
    messages
}

/// The messages that remove a zone from the broker and from Home Assistant.
pub(super) fn zone_withdrawal(topics: &Topics, camera: &str, zone: &str) -> Vec<Message> {
    let mut messages = config_withdrawals(topics, camera, Some(zone));
    let of_zone = [
        topics.zone(camera, zone),
        topics.zone_occupancy(camera, zone),
    ];
    messages.extend(of_zone.map(Message::forget));
    messages
}
