//! The parameters of one request, by name.

use std::str::FromStr;

use super::{ParameterDefault, ParameterError, ParameterSpec};

/// The parameter values of a request, at most one for each parameter of a table.
#[derive(Debug)]
pub struct GivenParameters<'a>(Vec<(&'static str, &'a str)>);

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
        Ok(Self(given))
    }

    /// Returns the text of a parameter in the request.
    #[must_use]
    pub fn text(&self, spec: &ParameterSpec) -> Option<&'a str> {
        let mut given = self.0.iter();
        given
            .find(|(name, _)| *name == spec.name)
            .map(|(_, value)| *value)
    }

    /// Parses the value of a parameter, or its default in the table; `None` without either.
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
