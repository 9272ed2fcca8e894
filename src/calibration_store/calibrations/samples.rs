//! The calibrations of the sample frames, built into the program as `sample-NAME`: the first
//! request and the web page show floor positions with them. Lists of calibrations leave them out. A
//! file of the same ID in the store takes their place.

use std::{
    collections::HashMap,
    sync::{Arc, LazyLock},
};

use lookdown_calibration::{CalibrationId, native::NativeCalibration};

use super::{CalibrationEntry, Reading, content::import, load::written_name};
use crate::samples::SAMPLES;

static ENTRIES: LazyLock<HashMap<CalibrationId, Arc<CalibrationEntry>>> = LazyLock::new(|| {
    let files = SAMPLES.iter().map(|sample| sample.calibration);
    files.filter_map(read).collect()
});

/// Returns the calibration of the sample frame `id`, such as `sample-office`.
pub(super) fn sample(id: &CalibrationId) -> Option<&'static Arc<CalibrationEntry>> {
    ENTRIES.get(id)
}

fn read(file: &str) -> Option<(CalibrationId, Arc<CalibrationEntry>)> {
    let mut native: NativeCalibration = serde_json::from_str(file).ok()?;
    native.id = format!("sample-{}", native.id);
    let id = native.id.parse().ok()?;
    let content = serde_json::to_vec(&native).ok()?;
    let (entry, _) = import(&id, &written_name(&id), &content, &Reading::default()).ok()?;
    Some((id, Arc::new(entry)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_sample_has_its_calibration() {
        for name in crate::samples::NAMES {
            let id: CalibrationId = format!("sample-{name}").parse().unwrap();
            let entry = sample(&id).unwrap();
            assert_eq!(entry.calibration.id(), &id);
            assert_eq!(entry.native.mount.height_m, Some(2.9));
        }
    }
}
