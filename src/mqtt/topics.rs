//! The names of topics.

use sha2::{Digest, Sha256};

/// Longest name that is used unchanged in a topic.
const MAX_CHARS: usize = 64;
/// Characters that are kept of a name that is changed, to recognize it by.
const RECOGNIZABLE_CHARS: usize = 32;

/// The names of topics.
#[derive(Debug, Clone)]
pub(super) struct Topics {
    prefix: String,
    /// The prefix of Home Assistant.
    discovery: Option<String>,
}

impl Topics {
    pub(super) fn new(prefix: &str, discovery: Option<&str>) -> Self {
        Self {
            prefix: prefix.to_owned(),
            discovery: discovery.map(ToOwned::to_owned),
        }
    }

    /// The topic of the connection status.
    pub(super) fn status(&self) -> String {
        format!("{}/status", self.prefix)
    }

    /// A topic of `lookdown count`.
    pub(super) fn counts(&self, rest: &str) -> String {
        format!("{}/counts/{rest}", self.prefix)
    }

    /// The rest of a topic of `lookdown count`.
    pub(super) fn below_counts<'a>(&self, topic: &'a str) -> Option<&'a str> {
        let rest = topic.strip_prefix(&self.prefix)?;
        rest.strip_prefix("/counts/")
    }

    /// The topic of the number of persons in a zone.
    pub(super) fn zone(&self, camera: &str, zone: &str) -> String {
        self.of_camera(camera, &format!("zones/{}", level(zone)))
    }

    /// The topic of a zone's occupancy.
    pub(super) fn zone_occupancy(&self, camera: &str, zone: &str) -> String {
        format!("{}/occupancy", self.zone(camera, zone))
    }

    /// The topic of a straight view of a camera.
    pub(super) fn view(&self, camera: &str, view: &str) -> String {
        self.of_camera(camera, &format!("views/{}", level(view)))
    }

    /// The topic of the newest image of a straight view.
    pub(super) fn view_image(&self, camera: &str, view: &str) -> String {
        format!("{}/image", self.view(camera, view))
    }

    /// The topic of the commands of a camera's switch for detection.
    pub(super) fn detection_command(&self, camera: &str) -> String {
        self.of_camera(camera, "detection/set")
    }

    /// Filters for the topics that [`Topics::switch_topic`] recognizes.
    pub(super) fn switch_filters(&self) -> [String; 2] {
        ["+/detection", "+/detection/set"].map(|rest| format!("{}/cameras/{rest}", self.prefix))
    }

    /// Recognizes a topic of a camera's switch: returns the level of its name, and true for
    /// commands.
    pub(super) fn switch_topic<'a>(&self, topic: &'a str) -> Option<(&'a str, bool)> {
        let (camera, rest) = self.below_cameras(topic)?;
        match rest {
            "detection" => Some((camera, false)),
            "detection/set" => Some((camera, true)),
            _ => None,
        }
    }

    /// The level of a camera and the rest of one of its topics.
    fn below_cameras<'a>(&self, topic: &'a str) -> Option<(&'a str, &'a str)> {
        let topic = topic
            .strip_prefix(&self.prefix)?
            .strip_prefix("/cameras/")?;
        topic.split_once('/')
    }

    /// Filters for the topics that [`Topics::camera_topic`] recognizes.
    pub(super) fn camera_filters(&self) -> [String; 4] {
        ["+/persons", "+/availability", "+/zones/+", "+/views/+"]
            .map(|rest| format!("{}/cameras/{rest}", self.prefix))
    }

    /// Recognizes `persons`, `availability`, and `zones/` or `views/` with the level of a name:
    /// returns the level of the camera, and the rest of the topic.
    pub(super) fn camera_topic<'a>(&self, topic: &'a str) -> Option<(&'a str, &'a str)> {
        let (camera, rest) = self.below_cameras(topic)?;
        let is_known = ["persons", "availability"].contains(&rest) || is_part(rest);
        is_known.then_some((camera, rest))
    }

    /// A topic of a camera: `frame_persons` of its latest frame, `persons` that it sees now,
    /// `occupancy`, `availability`, `attributes` of its entities, its latest `image`, `detection`
    /// for the state of its switch, or `report`.
    pub(super) fn of_camera(&self, camera: &str, topic: &str) -> String {
        format!("{}/cameras/{}/{topic}", self.prefix, level(camera))
    }

    /// The topic on which Home Assistant announces its start.
    pub(super) fn birth(&self) -> Option<String> {
        self.discovery
            .as_ref()
            .map(|prefix| format!("{prefix}/status"))
    }

    /// The topic on which Home Assistant looks for an entity with this ID.
    pub(super) fn config(&self, component: &str, unique_id: &str) -> Option<String> {
        let prefix = self.discovery.as_ref()?;
        Some(format!("{prefix}/{component}/{unique_id}/config"))
    }

    /// The ID that identifies a camera in Home Assistant.
    pub(super) fn device_id(&self, camera: &str) -> String {
        format!("{}_{}", level(&self.prefix), level(camera))
    }
}

/// Returns true for a topic of a zone or a view, below that of its camera.
pub(super) fn is_part(rest: &str) -> bool {
    let has_parts = rest.starts_with("zones/") || rest.starts_with("views/");
    has_parts && rest.matches('/').count() == 1
}

/// Returns a name as one level of a topic, in the alphabet of Home Assistant's IDs
/// (`[a-zA-Z0-9_-]`). Different names stay different: a changed name gets a part of its digest.
pub(super) fn level(name: &str) -> String {
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !name.is_empty() && name.len() <= MAX_CHARS && name.chars().all(fits) {
        return name.to_owned();
    }
    let characters = name.chars().take(RECOGNIZABLE_CHARS);
    let recognizable: String = characters.map(|c| if fits(c) { c } else { '_' }).collect();
    let digest = Sha256::digest(name);
    let [a, b, c, d] = [digest[0], digest[1], digest[2], digest[3]];
    format!("{recognizable}-{a:02x}{b:02x}{c:02x}{d:02x}")
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn plain_names_are_used_unchanged() {
        let topics = Topics::new("lookdown", Some("homeassistant"));
        assert_eq!(
            topics.of_camera("lobby", "persons"),
            "lookdown/cameras/lobby/persons"
        );
        assert_eq!(
            topics.zone("Lobby-2", "till"),
            "lookdown/cameras/Lobby-2/zones/till"
        );
        assert_eq!(
            topics.of_camera("lobby", "report"),
            "lookdown/cameras/lobby/report"
        );
        assert_eq!(topics.birth().unwrap(), "homeassistant/status");
        let id = topics.device_id("lobby");
        assert_eq!(id, "lookdown_lobby");
        assert_eq!(
            topics.config("sensor", &id).unwrap(),
            "homeassistant/sensor/lookdown_lobby/config"
        );
        let without = Topics::new("lookdown", None);
        assert_eq!(
            (without.birth(), without.config("sensor", "x")),
            (None, None)
        );
    }

    #[test]
    fn topics_of_cameras_are_recognized() {
        let topics = Topics::new("home/lookdown", None);
        let camera = "lobby";
        for (topic, expected) in [
            (topics.of_camera(camera, "persons"), "persons"),
            (topics.of_camera(camera, "availability"), "availability"),
            (topics.zone(camera, "till"), "zones/till"),
            (topics.view(camera, "door"), "views/door"),
        ] {
            assert_eq!(topics.camera_topic(&topic), Some((camera, expected)));
        }
        for other in [
            topics.status(),
            topics.of_camera(camera, "report"),
            topics.of_camera(camera, "attributes"),
            topics.zone_occupancy(camera, "till"),
            topics.view_image(camera, "door"),
            "lookdown/cameras/lobby/persons".to_owned(),
        ] {
            assert_eq!(topics.camera_topic(&other), None, "{other}");
        }
    }

    #[test]
    fn topics_of_switches_are_recognized() {
        let topics = Topics::new("home/lookdown", None);
        let camera = "lobby";
        for (topic, expected) in [
            (topics.of_camera(camera, "detection"), (camera, false)),
            (topics.detection_command(camera), (camera, true)),
        ] {
            assert_eq!(topics.switch_topic(&topic), Some(expected));
            assert_eq!(topics.camera_topic(&topic), None);
        }
        assert_eq!(
            topics.switch_topic(&topics.of_camera(camera, "persons")),
            None
        );
    }

    #[test]
    fn names_that_become_alike_stay_distinct() {
        let names = [
            "north gate",
            "north+gate",
            "north#gate",
            "north/gate",
            "",
            "#",
        ];
        let levels = std::collections::BTreeSet::from(names.map(level));
        assert_eq!(levels.len(), names.len(), "{levels:?}");
        assert_eq!(level("north gate"), "north_gate-d44d9e17");
    }

    proptest! {
        #[test]
        fn every_name_is_one_short_level_without_wildcards(name in ".{0,128}") {
            let level = level(&name);
            prop_assert!((1..=MAX_CHARS).contains(&level.len()));
            prop_assert!(level.chars().all(|c| c.is_ascii_alphanumeric() || "_-".contains(c)));
            // Topics of levels are those of the names.
            prop_assert_eq!(super::level(&level), level);
        }
    }
}
