//! The numbers of a camera or a site: their topics, and the IDs of their entities.

use crate::mqtt::discovery::{BINARY_SENSOR, SENSOR};

/// The topic below that of an owner with its availability.
pub(super) const AVAILABILITY: &str = "availability";

/// The owner of numbers, by the level of its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Owner<'a> {
    Camera(&'a str),
    Site(&'a str),
}

impl<'a> Owner<'a> {
    /// Recognizes an owner by its path. Returns the rest of the topic, too.
    pub(super) fn from_topic(topic: &'a str) -> Option<(Self, &'a str)> {
        let (kind, rest) = topic.split_once('/')?;
        let (name, rest) = rest.split_once('/')?;
        match kind {
            "cameras" => Some((Self::Camera(name), rest)),
            "sites" => Some((Self::Site(name), rest)),
            _ => None,
        }
    }

    /// The path of its topics below `counts`.
    pub(super) fn path(self) -> String {
        match self {
            Self::Camera(name) => format!("cameras/{name}"),
            Self::Site(name) => format!("sites/{name}"),
        }
    }

    /// The topic of its availability, below `counts`.
    pub(super) fn availability(self) -> String {
        format!("{}/{AVAILABILITY}", self.path())
    }

    /// The topic of the attributes of its number of persons, below `counts`.
    pub(super) fn attributes(self) -> String {
        format!("{}/attributes", self.path())
    }

    /// The name of its device in Home Assistant, after the prefix of the topics.
    pub(super) fn device(self) -> String {
        match self {
            Self::Camera(name) => name.to_owned(),
            Self::Site(name) => format!("site_{name}"),
        }
    }
}

/// A number that is published, by the levels of names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Number<'a> {
    Persons,
    /// On or off: someone is on the floor of a camera.
    FloorAlert,
    Crossings {
        line: &'a str,
        direction: &'a str,
    },
    ZonePersons {
        zone: &'a str,
    },
    Entries {
        zone: &'a str,
    },
    DwellSeconds {
        zone: &'a str,
    },
}

impl<'a> Number<'a> {
    /// Recognizes a number by its topic below that of its owner.
    pub(super) fn from_topic(topic: &'a str) -> Option<Self> {
        let levels: Vec<_> = topic.split('/').collect();
        match levels[..] {
            ["persons"] => Some(Self::Persons),
            ["floor_alert"] => Some(Self::FloorAlert),
            ["lines", line, direction] => Some(Self::Crossings { line, direction }),
            ["zones", zone, "persons"] => Some(Self::ZonePersons { zone }),
            ["zones", zone, "entries"] => Some(Self::Entries { zone }),
            ["zones", zone, "dwell_seconds"] => Some(Self::DwellSeconds { zone }),
            _ => None,
        }
    }

    /// The numbers that exist only together with this one.
    pub(super) fn with_companions(self) -> Vec<Self> {
        match self {
            Self::Persons | Self::FloorAlert | Self::Crossings { .. } => vec![self],
            Self::ZonePersons { zone } | Self::Entries { zone } | Self::DwellSeconds { zone } => {
                Self::for_zone(zone).to_vec()
            }
        }
    }

    /// The numbers of a zone.
    pub(super) fn for_zone(zone: &'a str) -> [Self; 3] {
        [
            Self::ZonePersons { zone },
            Self::Entries { zone },
            Self::DwellSeconds { zone },
        ]
    }

    /// Its topic below that of its owner.
    pub(super) fn topic(self) -> String {
        match self {
            Self::Persons => "persons".to_owned(),
            Self::FloorAlert => "floor_alert".to_owned(),
            Self::Crossings { line, direction } => format!("lines/{line}/{direction}"),
            Self::ZonePersons { zone } => format!("zones/{zone}/persons"),
            Self::Entries { zone } => format!("zones/{zone}/entries"),
            Self::DwellSeconds { zone } => format!("zones/{zone}/dwell_seconds"),
        }
    }

    /// The component of its entity.
    pub(super) fn component(self) -> &'static str {
        match self {
            Self::FloorAlert => BINARY_SENSOR,
            _ => SENSOR,
        }
    }

    /// The ID of its entity within the device of its owner.
    pub(super) fn entity(self) -> String {
        match self {
            Self::Persons => "count_tracked".to_owned(),
            Self::FloorAlert => "count_floor_alert".to_owned(),
            Self::Crossings { line, direction } => format!("count_line_{line}_{direction}"),
            Self::ZonePersons { zone } => format!("count_tracked_in_{zone}"),
            Self::Entries { zone } => format!("count_entries_{zone}"),
            Self::DwellSeconds { zone } => format!("count_dwell_{zone}"),
        }
    }
}
