//! The height of a camera from the people in its frames and reports.

use std::{path::PathBuf, sync::Arc};

use anyhow::Context;
use lookdown_calibration::{
    Calibration,
    native::{NativeCalibration, SourcedValue},
};
use lookdown_detect::{
    parameters::DetectParameters,
    pipeline::{DetectJob, JobImage},
};
use lookdown_imaging::Frame;
use lookdown_lens::{
    geometry::OrientedBox,
    self_calibration::{CameraHeight, LevelFromPeople},
};

use super::report_file::people_in_reports;
use crate::{
    app::engine_for,
    cli::settings_file::SettingsFile,
    room_calibration::{self, checked, may_set_height},
};

/// The origin of the people.
pub(super) struct PeopleSource<'a> {
    /// Frames in which people are detected.
    pub(super) frames: &'a [Frame],
    /// Files of reports.
    pub(super) reports: &'a [PathBuf],
    /// The settings of the detection.
    pub(super) settings: &'a SettingsFile,
}

/// Sets the height of the calibration from people, and reports it. A height that was measured or
/// given is kept.
pub(super) fn set_height(
    calibration: &mut NativeCalibration,
    source: &PeopleSource<'_>,
) -> anyhow::Result<()> {
    if let Some(known) = calibration.mount.height_m
        && !may_set_height(calibration)
    {
        anyhow::bail!(
            "mount.height_m is {known} m: remove it from the file to find it from people"
        );
    }
    let height = height_of(calibration, source)?;
    room_calibration::set_height(calibration, &height);
    let level = height.level;
    eprintln!(
        "lookdown: the camera is {:.2} m above the floor (standard deviation {:.2} m), by {} people \
         whose mean stature is taken as 1.70 m",
        height.height_m, height.sd_m, height.people
    );
    if let Some(level) = level {
        report_level(&level, calibration);
    }
    Ok(())
}

/// Compares the level of the people with that of the calibration.
fn report_level(level: &LevelFromPeople, calibration: &NativeCalibration) {
    let LevelFromPeople {
        difference_deg,
        sd_deg,
    } = level;
    let source = calibration.sources.get(&SourcedValue::WorldUp);
    let known_sd_deg = source.and_then(|source| source.uncertainty).unwrap_or(0.0);
    let verdict = if level.contradicts(known_sd_deg) {
        ": mount.world_up may be wrong; check it with --preview"
    } else {
        ", which does not contradict the calibration"
    };
    eprintln!(
        "lookdown: by the same people, the vertical differs by {difference_deg:.1}° (standard deviation {sd_deg:.1}°)\
         {verdict}"
    );
}

/// Finds the height from all people. Their boxes are in pixels of the calibration.
fn height_of(
    calibration: &NativeCalibration,
    source: &PeopleSource<'_>,
) -> anyhow::Result<CameraHeight> {
    let camera = Arc::new(checked(calibration)?);
    let parameters = DetectParameters::parse([("calibration", camera.id().as_str())])?;
    let mut people = Vec::new();
    for path in source.reports {
        people.extend(people_in_reports(path, &camera, &parameters)?);
    }
    if !source.frames.is_empty() {
        people.extend(people_in_frames(source, &camera, &parameters)?);
    }
    CameraHeight::from_people(&people, camera.lens(), camera.mount())
        .context("the height of the camera cannot be found")
}

/// Detects the people in the frames.
fn people_in_frames(
    source: &PeopleSource<'_>,
    camera: &Arc<Calibration>,
    parameters: &DetectParameters,
) -> anyhow::Result<Vec<OrientedBox>> {
    let settings = source.settings.load()?;
    let engine = engine_for(&settings, std::slice::from_ref(parameters))?;
    let (width, _) = camera.image_size();
    let mut people = Vec::new();
    for frame in source.frames {
        let image = JobImage::Decoded(Arc::new(frame.clone()));
        let calibration = Some(Arc::clone(camera));
        let job = DetectJob::local(
            camera.id().to_string(),
            image,
            parameters.clone(),
            calibration,
        );
        let persons = engine.detect(&job)?.report.persons;
        let scale = f64::from(width) / f64::from(frame.width());
        people.extend(
            persons
                .iter()
                .map(|person| person.oriented_box.scaled(scale)),
        );
    }
    Ok(people)
}
