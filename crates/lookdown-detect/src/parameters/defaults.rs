//! Default values of parameters: those of a camera, in its calibration, and those of the server, in
//! its settings. The built-in ones are rows of the table in `detect_parameters.rs`.

use strum::IntoStaticStr;

/// The origin of a default value, the one that takes precedence first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum DefaultSource {
    /// The calibration of the camera.
    Calibration,
    /// The settings of the server.
    Server,
}

impl DefaultSource {
    /// Returns the name, as in reports.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// A default value that a request was processed with.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DefaultUsed {
    /// The name of the parameter.
    pub name: &'static str,
    /// The value as a request would give it.
    pub value: String,
    /// The origin of the value.
    pub source: DefaultSource,
}

/// Checked default values of some parameters.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct DetectDefaults(Vec<(&'static str, String)>);

impl DetectDefaults {
    /// Wraps checked values.
    pub(super) fn new(values: Vec<(&'static str, String)>) -> Self {
        Self(values)
    }

    /// Returns the values by name.
    pub fn values(&self) -> impl Iterator<Item = (&'static str, &str)> {
        self.0.iter().map(|(name, value)| (*name, value.as_str()))
    }

    /// Returns whether the parameter `name` has a default.
    pub fn has(&self, name: &str) -> bool {
        self.values().any(|(known, _)| known == name)
    }
}
