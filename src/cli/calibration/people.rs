//! The height of a camera from the people in its frames.

use std::sync::Arc;

use anyhow::Context;
use lookdown_detect::{
    imaging::Frame,
    parameters::DetectParameters,
    pipeline::{DetectJob, JobImage},
};
use lookdown_lens::{
    calibration::{
        CalibrationFile, CalibrationId,
        export::Target,
        native::{NativeCalibration, NativeSource, ValueSource},
    },
    self_calibration::CameraHeight,
};

use crate::{app::engine_for, cli::settings_file::SettingsFile};

/// Sets the height of the calibration from the people in the frames, and reports it. A height that
/// was measured or given is kept.
pub(super) fn set_height(
    calibration: &mut NativeCalibration,
    frames: &[Frame],
    settings: &SettingsFile,
) -> anyhow::Result<()> {
    let source = calibration.sources.get("height_m");
    let from_people = source.is_some_and(|source| source.source == ValueSource::FromPeople);
    if let Some(known) = calibration.mount.height_m
        && !from_people
    {
        anyhow::bail!(
            "mount.height_m is {known} m: remove it from the file to find it from people"
        );
    }
    let height = height_of(calibration, frames, settings)?;
    calibration.mount.height_m = Some(hundredths(height.height_m));
    let source = NativeSource {
        source: ValueSource::FromPeople,
        uncertainty: Some(hundredths(height.sd_m)),
    };
    calibration.sources.insert("height_m".to_owned(), source);
    eprintln!(
        "lookdown: the camera is {:.2} m above the floor (standard deviation {:.2} m), by {} people \
         whose mean stature is taken as 1.70 m",
        height.height_m, height.sd_m, height.people
    );
    Ok(())
}

/// Detects the people with the calibration.
fn height_of(
    calibration: &NativeCalibration,
    frames: &[Frame],
    settings: &SettingsFile,
) -> anyhow::Result<CameraHeight> {
    let written = Target::Native.write(calibration)?.content;
    let file = CalibrationFile::parse(written.as_bytes())?;
    let mut checked = file.calibrations(&calibration.id, written.as_bytes());
    let camera = Arc::new(checked.swap_remove(0).1?);
    let id: &CalibrationId = camera.id();
    let parameters = DetectParameters::parse([("calibration", id.as_str())])?;
    let settings = settings.load()?;
    let engine = engine_for(&settings, std::slice::from_ref(&parameters))?;
    let mut people = Vec::new();
    for frame in frames {
        let image = JobImage::Decoded(Arc::new(frame.clone()));
        let calibration = Some(Arc::clone(&camera));
        let job = DetectJob::local(id.to_string(), image, parameters.clone(), calibration);
        let detected = engine.detect(&job)?;
        let persons = detected.report.persons;
        people.extend(persons.into_iter().map(|person| person.oriented_box));
    }
    CameraHeight::from_people(&people, camera.lens(), camera.mount())
        .context("the height of the camera cannot be found")
}

/// Rounds to centimeters.
fn hundredths(meters: f64) -> f64 {
    (meters * 100.0).round() / 100.0
}
