//! The parameters of one request, by name.

use std::str::FromStr;

use strum::IntoStaticStr;

use super::{ParameterDefault, ParameterError, ParameterSpec};

/// The parameter values of a request, at most one for each parameter of a table, and defaults for
/// those that it omits.
#[derive(Debug)]
pub struct GivenParameters<'a> {
    request: Vec<(&'static str, &'a str)>,
    defaults: Vec<(&'static str, &'a str, DefaultSource)>,
}

impl<'a> GivenParameters<'a> {
    /// Reads `(name, value)` pairs.
    ///
    /// # Errors
    /// Returns a [`ParameterError`] for a repeated name or a name that is not in the table.
    pub fn read(
        table: &'static [ParameterSpec],
        pairs: impl IntoIterator<Item = (&'a str, &'a str)>,
    ) -> Result<Self, ParameterError> {
        let mut given: Vec<(&str, &str)> = Vec::new();
        for (name, value) in pairs {
            let Some(known) = table.iter().find(|spec| spec.name == name) else {
                let known: Vec<_> = table.iter().map(|spec| spec.name).collect();
                let known = known.join(", ");
                let problem = format!("there is no such parameter; the parameters are {known}");
                return Err(ParameterError::unknown(name, problem));
            };
            if given.iter().any(|(earlier, _)| *earlier == known.name) {
                return Err(ParameterError::repeated(name));
            }
            given.push((known.name, value));
        }
        Ok(Self {
            request: given,
            defaults: Vec::new(),
        })
    }

    /// Adds defaults, those with precedence first, for the parameters that the request omits.
    pub fn with_defaults(mut self, layers: &[(DefaultSource, &'a DetectDefaults)]) -> Self {
        for (source, defaults) in layers {
            for (name, value) in defaults.values() {
                let has_default = self.defaults.iter().any(|(known, ..)| *known == name);
                if !has_default && !self.request.iter().any(|(known, _)| *known == name) {
                    self.defaults.push((name, value, *source));
                }
            }
        }
        self
    }

    /// Drops the default of a parameter.
    pub fn drop_default(&mut self, spec: &ParameterSpec) {
        self.defaults.retain(|(name, ..)| *name != spec.name);
    }

    /// Returns the defaults that complete the request.
    pub fn defaults_used(&self) -> Vec<DefaultUsed> {
        let used = self
            .defaults
            .iter()
            .map(|(name, value, source)| DefaultUsed {
                name,
                value: (*value).to_owned(),
                source: *source,
            });
        used.collect()
    }

    /// Returns the text of a parameter in the request or in the defaults.
    pub fn text(&self, spec: &ParameterSpec) -> Option<&'a str> {
        let defaults = self.defaults.iter().map(|(name, value, _)| (*name, *value));
        let mut given = self.request.iter().copied().chain(defaults);
        given
            .find(|(name, _)| *name == spec.name)
            .map(|(_, value)| value)
    }

    /// Parses the value of a parameter, or its default; `None` without either.
    ///
    /// # Errors
    /// Returns a [`ParameterError`] for an invalid value.
    pub fn optional<T: FromStr>(&self, spec: &ParameterSpec) -> Result<Option<T>, ParameterError> {
        let default = match spec.default {
            ParameterDefault::Value(value) => Some(value),
            ParameterDefault::Described(_) | ParameterDefault::None => None,
        };
        let text = self.text(spec).or(default);
        text.map(|value| spec.parse(value)).transpose()
    }

    /// Parses the value of a parameter whose default is in the table.
    ///
    /// # Errors
    /// Returns a [`ParameterError`] for an invalid value.
    pub fn value<T: FromStr>(&self, spec: &ParameterSpec) -> Result<T, ParameterError> {
        let missing = || ParameterError::bad_value(spec.name, "a value is required".to_owned());
        self.optional(spec)?.ok_or_else(missing)
    }
}

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
