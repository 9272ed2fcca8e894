//! The tables of the settings file that are lists: cameras and webhooks.

use lookdown_common::parse_toml;
use lookdown_count::WebhookEntry;
use lookdown_watch::CameraEntry;
use serde::Deserialize;

use super::SettingsError;

/// The names of these tables.
pub(super) const NAMES: [&str; 3] = ["cameras", "camera_defaults", "webhooks"];
/// These tables as they are written.
pub(super) const TABLES: [&str; 3] = ["[[cameras]]", "[camera_defaults]", "[[webhooks]]"];

/// Cameras and webhooks as they are written.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
pub struct ListSettings {
    /// The values of keys that a camera does not have.
    #[serde(default)]
    pub camera_defaults: CameraEntry,
    /// The cameras of `lookdown run` and `lookdown watch`.
    #[serde(default)]
    pub cameras: Vec<CameraEntry>,
    /// The receivers of messages of `lookdown run` and `lookdown count`.
    #[serde(default)]
    pub webhooks: Vec<WebhookEntry>,
}

impl ListSettings {
    /// The lists in the text of a settings file.
    pub(super) fn read(text: &str) -> Result<Self, SettingsError> {
        Ok(parse_toml(
            text,
            "the settings file",
            "docs/configuration.md",
        )?)
    }
}
