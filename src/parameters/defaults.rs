//! Default values of parameters: those of a camera, in its calibration, and those of the server, in
//! its settings.

use strum::IntoStaticStr;

use super::{DetectParameters, Interface, ParameterError, ParameterSpec};

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
    #[must_use]
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// Longest text of a value: reports repeat it.
const MAX_CHARS: usize = 128;

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
    /// Checks `(name, value)` pairs.
    ///
    /// # Errors
    /// [`ParameterError`] for a repeated name, a name of a parameter without such defaults, and a
    /// value out of range.
    pub fn parse<'a>(
        pairs: impl IntoIterator<Item = (&'a str, &'a str)>,
    ) -> Result<Self, ParameterError> {
        let pairs: Vec<_> = pairs.into_iter().collect();
        let mut values = Vec::with_capacity(pairs.len());
        for (name, value) in &pairs {
            let Some(spec) = Self::offered().find(|spec| spec.name == *name) else {
                let known: Vec<_> = Self::offered().map(|spec| spec.name).collect();
                let known = known.join(", ");
                let problem = format!("no default can be set for it; use one of {known}");
                return Err(ParameterError::unknown(name, problem));
            };
            if value.chars().count() > MAX_CHARS {
                let problem = format!("it is longer than {MAX_CHARS} characters");
                return Err(ParameterError::bad_value(name, problem));
            }
            values.push((spec.name, (*value).to_owned()));
        }
        // Motion detection needs a camera, which the request names.
        let camera = [(DetectParameters::CAMERA, "camera")];
        DetectParameters::parse(pairs.into_iter().chain(camera))?;
        Ok(Self(values))
    }

    /// Lists the parameters for which defaults can be set.
    pub fn offered() -> impl Iterator<Item = &'static ParameterSpec> {
        let table = DetectParameters::TABLE.iter();
        table.filter(|spec| spec.is_offered_by(Interface::Defaults))
    }

    /// Returns the values by name.
    pub fn values(&self) -> impl Iterator<Item = (&'static str, &str)> {
        self.0.iter().map(|(name, value)| (*name, value.as_str()))
    }

    /// Returns whether the parameter `name` has a default.
    #[must_use]
    pub fn has(&self, name: &str) -> bool {
        self.values().any(|(known, _)| known == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn defaults(pairs: &[(&str, &str)]) -> DetectDefaults {
        DetectDefaults::parse(pairs.iter().copied()).unwrap()
    }

    fn parse(pairs: &[(&str, &str)], camera: &DetectDefaults) -> DetectParameters {
        let server = defaults(&[("profile", "fast"), ("score_threshold", "0.6")]);
        let layers = [
            (DefaultSource::Calibration, camera),
            (DefaultSource::Server, &server),
        ];
        DetectParameters::parse_with(pairs.iter().copied(), &layers).unwrap()
    }

    #[test]
    fn request_precedes_calibration_and_calibration_the_server() {
        let camera = defaults(&[("score_threshold", "0.5"), ("motion", "true")]);
        let used = |parameters: &DetectParameters| -> Vec<_> {
            let defaults = parameters.defaults.iter();
            defaults
                .map(|used| (used.name, used.value.clone(), used.source.name()))
                .collect()
        };
        let parameters = parse(&[("calibration", "lobby")], &camera);
        assert_eq!(parameters.refinement.score_threshold, 0.5);
        assert_eq!(parameters.profile.name(), "fast");
        assert!(parameters.motion);
        assert_eq!(
            used(&parameters),
            [
                ("score_threshold", "0.5".to_owned(), "calibration"),
                ("motion", "true".to_owned(), "calibration"),
                ("profile", "fast".to_owned(), "server"),
            ]
        );
        let request = [("camera", "hall"), ("score_threshold", "0.7")];
        let parameters = parse(&request, &camera);
        assert_eq!(parameters.refinement.score_threshold, 0.7);
        assert_eq!(used(&parameters).len(), 2);
    }

    #[test]
    fn default_motion_detection_skips_unnamed_cameras() {
        let parameters = parse(&[], &defaults(&[("motion", "true")]));
        assert!(!parameters.motion);
        assert!(parameters.defaults.iter().all(|used| used.name != "motion"));
    }

    #[test]
    fn invalid_defaults_are_refused_by_name() {
        for (name, value) in [
            ("profile", "best"),
            ("motion", "yes"),
            ("camera", "hall"),
            ("captured_at", "2026-11-21T09:30:00Z"),
            ("threshold", "1"),
        ] {
            let error = DetectDefaults::parse([(name, value)]).unwrap_err();
            assert_eq!(error.name, name);
        }
    }
}
