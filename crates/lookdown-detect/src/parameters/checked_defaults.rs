//! The check of default values: by the table of the parameters.

use super::{
    DefaultSource, DetectDefaults, DetectParameters, Interface, ParameterError, ParameterSpec,
};

/// Longest text of a value: reports repeat it.
const MAX_CHARS: usize = 128;

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
        Ok(Self::new(values))
    }

    /// Returns the default of the parameter `follow` for a frame of a camera.
    pub fn follow(&self) -> bool {
        let camera = [(DetectParameters::CAMERA, "camera")];
        let parameters = DetectParameters::parse_with(camera, &[(DefaultSource::Server, self)]);
        parameters.is_ok_and(|parameters| parameters.follow)
    }

    /// Lists the parameters for which defaults can be set.
    pub fn offered() -> impl Iterator<Item = &'static ParameterSpec> {
        let table = DetectParameters::TABLE.iter();
        table.filter(|spec| spec.is_offered_by(Interface::Defaults))
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
