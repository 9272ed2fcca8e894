//! Defaults of detection parameters. Their keys follow from the table of the parameters.

use std::sync::LazyLock;

use lookdown_detect::parameters::{DetectDefaults, ParameterSpec};

use super::{
    SettingsError,
    declare::Table,
    entry::Entry,
    form::{Form, Refusal, optional_text},
    values::Values,
};

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
