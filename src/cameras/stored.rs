//! A stored camera, and the file of all.

use std::collections::BTreeMap;

use lookdown_common::{ConfigError, StoredFile, plain_name};
use lookdown_watch::{CameraEntry, Location};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::state_folder::StateFolder;

/// The name in the path of a test, which no camera has.
pub(super) const TEST: &str = "test";
/// The file of the cameras in the state folder.
pub(super) const FILE: &str = "cameras.json";

/// A camera as it is stored, without its password.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StoredCamera {
    /// The URL of the source.
    pub url: String,
    /// The user name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub user: Option<String>,
    /// The interval between two frames.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub every: Option<String>,
    /// The ID of the calibration.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration: Option<String>,
    /// The profile.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profile: Option<String>,
    /// True if no frames are read.
    #[serde(default)]
    pub paused: bool,
    /// True if the latest image is kept.
    #[serde(default)]
    pub keep_image: bool,
}

impl StoredCamera {
    /// Returns the source without its query, which may hold a token.
    #[must_use]
    pub fn shown_source(&self) -> String {
        let location = Location::parse(&self.url);
        location.map_or_else(|_| String::new(), |(location, _)| location.to_string())
    }
}

/// Stored cameras by name.
pub type Stored = BTreeMap<String, StoredCamera>;

/// The content of the file of the cameras.
#[derive(Serialize)]
pub(super) struct CameraFile {
    version: u8,
    #[serde(flatten)]
    pub(super) cameras: Stored,
    /// Entries that are not cameras. They stay until they are replaced or deleted.
    #[serde(flatten)]
    pub(super) invalid: Map<String, Value>,
}

impl CameraFile {
    /// Reads the file in a state folder.
    pub(super) fn read(folder: &StateFolder) -> Result<Self, ConfigError> {
        let mut entries: Map<String, Value> = folder.read(FILE)?;
        if let Some(version) = entries.remove(StoredFile::KEY) {
            let checked = StoredFile::Cameras.check(&version.to_string());
            checked.map_err(|problem| folder.refused(FILE, &problem))?;
        }
        let (mut cameras, mut invalid) = (Stored::new(), Map::new());
        for (name, entry) in entries {
            match StoredCamera::deserialize(&entry) {
                Ok(camera) => drop(cameras.insert(name, camera)),
                Err(_) => drop(invalid.insert(name, entry)),
            }
        }
        Ok(Self {
            version: StoredFile::Cameras.version(),
            cameras,
            invalid,
        })
    }
}

/// Checks the name of a camera that is to be stored.
pub(super) fn check_name(name: &str) -> Result<(), ConfigError> {
    if plain_name::is_plain(name) && ![TEST, StoredFile::KEY].contains(&name) {
        return Ok(());
    }
    let remedy = "is not a name of 1 to 64 of a-z, 0-9, '_' and '-', and not test or version";
    Err(ConfigError::value("name", name, remedy))
}

/// Returns the entry of a stored camera, without its password.
pub(super) fn entry(name: &str, camera: &StoredCamera) -> CameraEntry {
    CameraEntry {
        name: Some(name.to_owned()),
        url: Some(camera.url.clone()),
        user: camera.user.clone(),
        every: camera.every.clone(),
        calibration: camera.calibration.clone(),
        profile: camera.profile.clone(),
        ..CameraEntry::default()
    }
}
