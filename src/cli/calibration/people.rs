//! The height of a camera from the people in its frames.

use std::sync::Arc;

use anyhow::Context;
use lookdown_detect::{
    imaging::Frame,
    parameters::DetectParameters,
    pipeline::{DetectJob, JobImage},
};
use lookdown_lens::{
    calibration::{CalibrationId, native::NativeCalibration},
    self_calibration::CameraHeight,
};

use crate::{
    app::engine_for,
    cli::settings_file::SettingsFile,
    room_calibration::{self, checked, may_set_height},
};

/// Sets the height of the calibration from the people in the frames, and reports it. A height that
/// was measured or given is kept.
pub(super) fn set_height(
    calibration: &mut NativeCalibration,
    frames: &[Frame],
    settings: &SettingsFile,
) -> anyhow::Result<()> {
    if let Some(known) = calibration.mount.height_m
        && !may_set_height(calibration)
    {
        anyhow::bail!(
            "mount.height_m is {known} m: remove it from the file to find it from people"
        );
    }
    let height = height_of(calibration, frames, settings)?;
    room_calibration::set_height(calibration, &height);
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
    let camera = Arc::new(checked(calibration)?);
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
