//! People from files of detection reports, JSON lines.

use std::{
    io::{BufRead, BufReader, Read},
    path::Path,
};

use anyhow::{Context, anyhow, bail};
use lookdown_calibration::Calibration;
use lookdown_common::{
    files::{self, Links},
    report::{MAX_REPORT_BYTES, Report, ReportOrientedBox},
};
use lookdown_detect::parameters::DetectParameters;
use lookdown_lens::geometry::{OrientedBox, Pixel, oriented_box::vertical_in_frame};

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
        let persons = persons.filter(|person| person.score >= threshold);
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
    let ReportOrientedBox {
        cx,
        cy,
        width,
        height,
        angle_deg,
    } = *reported;
    let angle = angle_deg.to_radians();
    let upright = OrientedBox::turned(Pixel::new(cx, cy), width, height, angle).scaled(scale);
    let vertical = vertical_in_frame(upright.center, camera.lens(), camera.mount());
    upright.with_head_toward(&vertical)
}
