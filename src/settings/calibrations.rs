//! The calibration store: a folder, and the memory for what is computed from it.
//!
//! The state that is changed over HTTP.
//!
//! Defaults of detection parameters. Their keys follow from the table of the parameters.

use std::{num::NonZeroU64, path::PathBuf, sync::LazyLock};

use lookdown_detect::{
    parameters::{DetectDefaults, DetectParameters, ParameterSpec},
    pipeline::EngineOptions,
};
use lookdown_lens::self_calibration::IdealLens;

use super::{
    SettingsError,
    declare::{Table, settings},
    entry::Entry,
    form::{
        Form, MAX_BYTES, Refusal, flag, optional, optional_text, path, poll_seconds, variant, whole,
    },
    locate::DEFAULT_CALIBRATIONS,
    results::CountSettings,
    values::Values,
};

settings! {
    /// The calibration store.
    #[derive(Debug, Clone, PartialEq)]
    pub struct CalibrationSettings in "calibrations" {
        /// The folder of calibration files (docs/calibrate.md). The default folder may be missing,
        /// any other must exist; `lookdown run` creates one with an absolute path in an existing
        /// folder. Replicas mount one folder as a volume.
        path: PathBuf = DEFAULT_CALIBRATIONS.into() => path();
        /// The interval in seconds at which the folder is checked for changes. 0: never. An
        /// invalid new version leaves the old one in use and shows in `/readyz`, in the metrics
        /// and in the log.
        poll_seconds: Option<NonZeroU64> = NonZeroU64::new(2) => poll_seconds();
        /// `true` if calibrations can be changed over HTTP by clients with the scope `admin`;
        /// `false` for replicas that only read.
        writable: bool = true => flag();
        /// The projection of the lenses of cameras without a calibration, from their data sheet.
        /// The server can find the calibration of a camera that looks straight down only with it.
        lens: Option<IdealLens> = None => optional(variant());
        /// `true` if a calibration that the server finds in five frames of a named camera is stored
        /// under the name of the camera, if it has none. `false`: it is only offered
        /// (docs/calibrate.md).
        apply_suggested: bool = false => flag();
        /// `true` if `/metrics` shows the number of persons in each zone, with the names of its
        /// camera and of the zone as labels: 1000 zones at most. `lookdown run` always does.
        zone_metrics: bool = false => flag();
        /// The most memory for the remap tables of cameras, in bytes. The least recently used go
        /// first.
        cache_bytes: usize = EngineOptions::RIG_CACHE_BYTES => whole(0..=MAX_BYTES);
    }
}

settings! {
    /// The state that is changed over HTTP.
    #[derive(Debug, Clone, PartialEq)]
    pub struct StateSettings in "state" {
        /// The folder of views, of reference counts, and of the cameras that are added to
        /// `lookdown run` over HTTP, with each password in a file that only its user can read. It
        /// is created when it is needed.
        path: PathBuf = "state".into() => path();
    }
}

/// The parameters with their keys.
static KEYS: LazyLock<Vec<(&'static ParameterSpec, String)>> = LazyLock::new(|| {
    let offered = DetectDefaults::offered();
    offered
        .map(|spec| (spec, format!("detect.{}", spec.name)))
        .collect()
});

impl Table for DetectDefaults {
    fn read(values: &Values) -> Result<Self, SettingsError> {
        let mut given = Vec::new();
        for (spec, key) in KEYS.iter() {
            if let Some(Some(value)) = values.get(key, &value(spec))? {
                given.push((spec.name, value));
            }
        }
        let names_floor = given
            .iter()
            .any(|(name, _)| *name == DetectParameters::FLOOR);
        if !names_floor && CountSettings::read(values)?.floor_alert {
            given.push((DetectParameters::FLOOR, "true".to_owned()));
        }
        let pairs = given.iter().map(|(name, value)| (*name, value.as_str()));
        Self::parse(pairs).map_err(|error| SettingsError::hidden("detect", error))
    }

    fn entries() -> Vec<Entry> {
        let entries = KEYS.iter().map(|(spec, key)| {
            let name = spec.name;
            let help = format!("The default of the parameter `{name}` (docs/parameters.md).");
            Entry::new(key, &[&help], &value(spec), &None)
        });
        entries.collect()
    }
}

/// A value of the parameter.
fn value(spec: &'static ParameterSpec) -> Form<Option<String>> {
    optional_text(spec.kind.rule(), |text| {
        let checked = DetectDefaults::parse([(spec.name, text)]);
        checked
            .map(|_| text.to_owned())
            .map_err(|_| Refusal::Shown(format!("give {}", spec.kind.rule())))
    })
}
