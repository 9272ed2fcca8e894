//! The height of a camera from the people in its frames and reports.
//!
//! People from files of detection reports, JSON lines.

use std::{
    io::{BufRead, BufReader, Read},
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, anyhow, bail};
use lookdown_calibration::{
    Calibration,
    native::{NativeCalibration, SourcedValue},
};
use lookdown_common::{
    files::{self, Links},
    report::{MAX_REPORT_BYTES, Report, ReportOrientedBox},
};
use lookdown_detect::{
    parameters::DetectParameters,
    pipeline::{DetectJob, JobImage},
};
use lookdown_imaging::Frame;
use lookdown_lens::{
    geometry::{OrientedBox, Pixel, oriented_box::vertical_in_frame},
    self_calibration::{CameraHeight, LevelFromPeople},
};

use crate::{
    app::engine_for,
    cli::server_flags::SettingsFile,
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
    let (difference_deg, sd_deg) = (level.difference_deg, level.sd_deg);
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
                .filter(|person| !person.lies())
                .map(|person| person.oriented_box.scaled(scale)),
        );
    }
    Ok(people)
}

/// Reads the people of all reports of a file, in pixels of the calibration. Persons below the
/// score threshold are left out: counts use reports with a very low one.
pub(super) fn people_in_reports(
    path: &Path,
    camera: &Calibration,
    parameters: &DetectParameters,
) -> anyhow::Result<Vec<OrientedBox>> {
    let name = path.display();
    let file = files::open(path, Links::Follow)
        .with_context(|| format!("--reports: {name} cannot be read"))?;
    let mut reader = BufReader::new(file);
    let mut people = Vec::new();
    for number in 1_u64.. {
        let read = next_line(&mut reader);
        let line = read.with_context(|| format!("--reports: {name}, line {number}"))?;
        let Some(line) = line else { break };
        if line.trim_ascii().is_empty() {
            continue;
        }
        let report = report(&line, camera);
        let report = report.with_context(|| format!("--reports: {name}, line {number}"))?;
        let scale = f64::from(camera.image_size().0) / f64::from(report.image.width);
        let threshold = parameters.refinement.score_threshold;
        let persons = report.persons.iter();
        let persons = persons.filter(|person| person.score >= threshold && !person.lies());
        people.extend(persons.map(|person| upright_box(&person.oriented_box, scale, camera)));
    }
    Ok(people)
}

/// Reads a line, or `None` at the end of the file.
fn next_line(reader: &mut impl BufRead) -> anyhow::Result<Option<Vec<u8>>> {
    let mut line = Vec::new();
    let mut bounded = reader.take(MAX_REPORT_BYTES + 1);
    let bytes = bounded.read_until(b'\n', &mut line)?;
    if bytes as u64 > MAX_REPORT_BYTES {
        let mebibytes = MAX_REPORT_BYTES >> 20;
        bail!(
            "it has more than {mebibytes} MiB: give one report per line, as `lookdown detect` prints them"
        );
    }
    Ok((bytes > 0).then_some(line))
}

/// Parses a report, and refuses one of another camera.
fn report(line: &[u8], camera: &Calibration) -> anyhow::Result<Report> {
    let parsed = serde_json::from_slice::<Report>(line);
    let report = parsed.map_err(|error| {
        let text = error.to_string();
        // The line of the error is that within the report.
        let reason = text
            .split_once(" at line ")
            .map_or(&*text, |(reason, _)| reason);
        anyhow!(
            "it is not a report ({reason}): give one report per line, as `lookdown detect` prints \
             them"
        )
    })?;
    let (used, id) = (&report.calibration, camera.id());
    if used.assumed {
        bail!("the report was made without a calibration: detect again with --calibration {id}");
    }
    if used.id != id.as_str() {
        bail!(
            "the report is of the calibration {}, not {id}: give reports of this camera only",
            used.id
        );
    }
    let (width, height) = (report.image.width, report.image.height);
    if width == 0 || camera.for_frame(width, height).is_err() {
        let (own_width, own_height) = camera.image_size();
        bail!(
            "the report is of a frame of {width}×{height} pixels, but {id} is for \
             {own_width}×{own_height}, which is a different aspect ratio: give reports of uncropped \
             frames of this camera"
        );
    }
    Ok(report)
}

/// Converts a box to pixels of the calibration, with the head at its upper end: the angle of a
/// report does not tell the head from the foot.
fn upright_box(reported: &ReportOrientedBox, scale: f64, camera: &Calibration) -> OrientedBox {
    let (center, angle) = (
        Pixel::new(reported.cx, reported.cy),
        reported.angle_deg.to_radians(),
    );
    let upright = OrientedBox::turned(center, reported.width, reported.height, angle).scaled(scale);
    let vertical = vertical_in_frame(upright.center, camera.lens(), camera.mount());
    upright.with_head_toward(&vertical)
}
