//! The state of each camera that the broker is to have, and its changes by reports and by time.

use std::{
    collections::{BTreeMap, HashSet},
    num::NonZeroUsize,
    time::Duration,
};

use lookdown_common::{Claim, OwnCameras, Place, makes_room};
use lookdown_tracking::taught::NumberWithBar;
use tokio::time::Instant;

use super::{
    camera::{Camera, Delays},
    discovery::{Discovery, OFFLINE, RetainedTopics, part_withdrawal, withdrawal},
    images::CameraImage,
    session::Message,
    topics::{Topics, is_part, level},
};
use crate::{results::StoredReport, views::Views};

/// Time after the connection until unknown cameras are withdrawn, where none expire.
const UNKNOWN_FOR: Duration = Duration::from_mins(10);

/// Returns the time after the connection until unknown cameras are withdrawn.
pub(super) fn unknown_for(discovery: &Discovery) -> Duration {
    discovery.expire_after.unwrap_or(UNKNOWN_FOR)
}

/// The published cameras, a bounded number of them beside those of this process.
pub(super) struct Cameras {
    topics: Topics,
    discovery: Discovery,
    delays: Delays,
    most: NonZeroUsize,
    own: OwnCameras,
    /// By the level of their topics.
    known: BTreeMap<String, Camera>,
    retained: RetainedTopics,
    /// The time at which the cameras of `retained` are withdrawn.
    withdraw_at: Option<Instant>,
    /// True once the warning about further cameras was logged.
    has_warned: bool,
}

impl Cameras {
    pub(super) fn new(
        topics: Topics,
        discovery: Discovery,
        hold: Duration,
        most: NonZeroUsize,
        own: OwnCameras,
    ) -> Self {
        Self {
            delays: Delays {
                hold,
                expire: discovery.expire_after,
            },
            topics,
            discovery,
            most,
            own,
            known: BTreeMap::new(),
            retained: RetainedTopics::default(),
            withdraw_at: None,
            has_warned: false,
        }
    }

    /// Updates the camera of a report whose frame arrived `age` ago, and whose headline number is
    /// `number`. Returns the messages to publish: none for a camera beyond the limit.
    pub(super) fn update(
        &mut self,
        report: &StoredReport,
        number: NumberWithBar,
        age: Duration,
        now: Instant,
    ) -> Vec<Message> {
        let report = &report.report;
        let name = report.camera.as_str();
        let key = level(name);
        let is_known = self.known.contains_key(&key);
        let mut messages = Vec::new();
        if !is_known && self.known.len() >= self.most.get() {
            if !self.has_warned {
                tracing::warn!(
                    most = self.most,
                    "more cameras than mqtt.max_cameras have sent frames: some are not published"
                );
            }
            self.has_warned = true;
            let claim = self.own.claim(name, false);
            match self.displaced(claim) {
                Some(camera) => messages.extend(camera.withdrawal(&self.topics)),
                None if claim == Claim::Own => {}
                None => return Vec::new(),
            }
        }
        let camera = self.known.entry(key).or_insert_with(|| Camera::new(name));
        let changes = camera.update(report, number, age, now, &self.delays);
        let topics = &self.topics;
        for zone in changes.removed_zones {
            messages.extend(part_withdrawal(topics, name, &zone));
        }
        if changes.entities || !is_known {
            messages.extend(camera.announced(topics, &self.discovery));
        }
        if changes.attributes || !is_known {
            messages.push(camera.attributes(topics));
        }
        messages.extend(camera.state(topics));
        let json = report.json.clone();
        messages.push(Message::passing(topics.of_camera(name, "report"), json));
        messages
    }

    /// Removes the camera that makes room for one with this claim.
    fn displaced(&mut self, claim: Claim) -> Option<Camera> {
        let places = self.known.iter().map(|(key, camera)| Place {
            camera: key.clone(),
            claim: self.own.claim(&camera.name, false),
            last: camera.expires_at,
            is_silent: !camera.is_available,
        });
        let key = makes_room(claim, places)?;
        self.known.remove(&key)
    }

    /// The message with the latest image of a camera or of one of its views: none for a camera that
    /// is not published.
    pub(super) fn image(&self, image: CameraImage) -> Option<Message> {
        let camera = &image.camera;
        let topic = match &image.view {
            Some(view) => self.topics.view_image(camera, view),
            None => self.topics.of_camera(camera, "image"),
        };
        let is_known = self.known.contains_key(&level(camera));
        is_known.then(|| Message::passing(topic, image.jpeg))
    }

    /// Updates the views of the cameras whose images are published. Returns the messages.
    pub(super) fn update_views(&mut self, views: &Views) -> Vec<Message> {
        let (topics, discovery) = (&self.topics, &self.discovery);
        let known = self.known.values_mut();
        let shown = known.filter(|camera| discovery.images.include(&camera.name));
        let messages = shown.flat_map(|camera| {
            let views = views.list(&camera.name);
            camera.set_views(views, topics, discovery)
        });
        messages.collect()
    }

    /// The names of the cameras that send frames.
    pub(super) fn available(&self) -> Vec<String> {
        let known = self.known.values().filter(|camera| camera.is_available);
        known.map(|camera| camera.name.clone()).collect()
    }

    /// Makes the paused cameras of this process unavailable: their last number is not the present
    /// one. Returns the messages.
    pub(super) fn pause(&mut self, now: Instant) -> Vec<Message> {
        let (topics, own) = (&self.topics, &self.own);
        let known = self.known.values_mut();
        let paused = known.filter(|camera| camera.is_available && own.is_paused(&camera.name));
        paused.flat_map(|camera| camera.end(now, topics)).collect()
    }

    /// Sets the headline number of a camera. Returns the messages: none without a change.
    pub(super) fn set_number(
        &mut self,
        camera: &str,
        number: NumberWithBar,
        now: Instant,
    ) -> Vec<Message> {
        let (topics, delays) = (&self.topics, &self.delays);
        let camera = self.known.get_mut(&level(camera));
        camera
            .filter(|camera| camera.is_available)
            .and_then(|camera| {
                let is_changed = camera.set_number(number, now, delays);
                is_changed.then(|| [camera.state(topics), vec![camera.attributes(topics)]].concat())
            })
            .unwrap_or_default()
    }

    /// All messages that the broker is to retain.
    pub(super) fn all(&mut self, now: Instant) -> Vec<Message> {
        let topics = &self.topics;
        let known = self.known.values_mut();
        let messages = known.flat_map(|camera| {
            camera.expire(now, topics);
            let mut messages = camera.announced(topics, &self.discovery);
            messages.extend(camera.view_messages(topics));
            messages.push(camera.attributes(topics));
            messages.extend(camera.state(topics));
            messages
        });
        messages.collect()
    }

    /// Begins a connection, at whose start the broker sends what it has retained.
    pub(super) fn begin_connection(&mut self, now: Instant) {
        self.retained = RetainedTopics::default();
        self.withdraw_at = Some(now + unknown_for(&self.discovery));
    }

    /// Compares a message of the broker with the state. Returns the messages that correct it.
    pub(super) fn compare(
        &mut self,
        topic: &str,
        payload: &[u8],
        is_retained: bool,
    ) -> Option<Message> {
        let (level, rest) = self.topics.camera_topic(topic)?;
        // The echo of a message that removes a topic.
        if payload.is_empty() {
            return None;
        }
        let known = self.known.get(level);
        if is_retained {
            // Without a time, the withdrawal of this connection is over.
            self.withdraw_at?;
            let is_new = self
                .retained
                .note(level, Some(rest).filter(|rest| is_part(rest)));
            let offline =
                || Message::retained(self.topics.of_camera(level, "availability"), OFFLINE);
            return (is_new && known.is_none()).then(offline);
        }
        match (rest, known) {
            // Another server has this camera.
            ("persons", None) => self.retained.keep(level),
            // Another server does not have it.
            ("availability", Some(camera))
                if camera.is_available && payload == OFFLINE.as_bytes() =>
            {
                return Some(camera.availability(&self.topics));
            }
            _ => {}
        }
        None
    }

    /// The time of the next change without a report.
    pub(super) fn next_change(&self) -> Option<Instant> {
        let known = self.known.values().filter_map(Camera::next_change);
        known.chain(self.withdraw_at).min()
    }

    /// Changes what has changed by now without a report. Returns the messages.
    pub(super) fn expire(&mut self, now: Instant) -> Vec<Message> {
        let topics = &self.topics;
        let known = self.known.values_mut();
        let mut messages: Vec<_> = known
            .flat_map(|camera| camera.expire(now, topics))
            .collect();
        if self.withdraw_at.is_some_and(|at| at <= now) {
            self.withdraw_at = None;
            for (key, parts) in self.retained.take() {
                match self.known.get(&key) {
                    None => messages.extend(withdrawal(topics, &key, parts)),
                    Some(camera) => {
                        let gone = parts.iter().filter(|part| !camera.has_part(part));
                        messages.extend(gone.flat_map(|part| part_withdrawal(topics, &key, part)));
                    }
                }
            }
        }
        messages
    }

    /// Removes the cameras that have no report any longer. Returns the messages.
    pub(super) fn retain(&mut self, cameras: &[String]) -> Vec<Message> {
        let kept: HashSet<_> = cameras.iter().map(|name| level(name)).collect();
        let removed = self.known.extract_if(.., |key, _| !kept.contains(key));
        let messages = removed.flat_map(|(_, camera)| camera.withdrawal(&self.topics));
        messages.collect()
    }
}

#[cfg(test)]
mod tests;
