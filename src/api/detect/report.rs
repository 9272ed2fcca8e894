//! Converts the report of the pipeline to the units and decimals of the API.
//!
//! The headers of a response about its report: the number of persons and the times of the stages.

use axum::http::{HeaderName, HeaderValue};
use lookdown_calibration::warning::Warning;
use lookdown_common::report::{
    Report, ReportBearing, ReportBox, ReportCalibration, ReportCircle, ReportDefault,
    ReportFloorVotes, ReportImage, ReportModel, ReportPerson, ReportRefinement, ReportTimings,
    ReportViews, ReportWarning, ReportZone,
};
use lookdown_detect::{
    parameters::DefaultUsed,
    pipeline::{self, DetectionReport, ModelUsed},
};
use lookdown_imaging::lens_circle::LensCircle;

use crate::rounding::{
    azimuth_degrees, degrees, floor, meters, milliseconds, oriented_box, pixels, share,
};

/// Converts a report of the pipeline.
pub fn to_report(report: &DetectionReport) -> Report {
    let refinement = &report.refinement;
    Report {
        request_id: report.request_id.clone(),
        camera: report.camera.clone(),
        received_at: format!("{:.3}", report.received_at),
        captured_at: report.captured_at.map(|time| time.to_string()),
        calibration: ReportCalibration {
            id: report.calibration.id.clone(),
            revision: report.calibration.revision.clone(),
            assumed: report.calibration.assumed_circle.is_some(),
            assumed_circle: report.calibration.assumed_circle.map(circle),
        },
        image: ReportImage {
            width: report.image_width,
            height: report.image_height,
        },
        model: to_model(&report.model),
        crop_model: report.crop_model.as_ref().map(to_model),
        profile: report.profile.name().into(),
        refinement: ReportRefinement {
            name: refinement.refinement.name().into(),
            score_threshold: refinement.score_threshold,
            iou_threshold: refinement.iou_threshold,
            sigma: refinement.sigma,
            max_detections: refinement.max_detections,
        },
        defaults: report.defaults.iter().map(to_default).collect(),
        search: report.search.name().into(),
        views: ReportViews {
            inferred: report.views.inferred,
            unchanged: report.views.unchanged,
            outside: report.views.outside,
            masked: report.views.masked,
            outside_areas: report.views.outside_areas,
            not_needed: report.views.not_needed,
        },
        persons: report.persons.iter().map(to_person).collect(),
        margin: report.margin.as_ref().map(|margin| {
            let margin = margin.iter();
            margin.map(to_person).collect()
        }),
        zones: (!report.zones.is_empty()).then(|| {
            let zones = report.zones.iter();
            zones.map(to_zone).collect()
        }),
        timings_ms: to_timings(&report.timings),
        warnings: report.warnings.iter().map(to_warning).collect(),
    }
}

/// Converts pixel centers to the corner-origin pixels of reports.
fn circle(circle: LensCircle) -> ReportCircle {
    ReportCircle {
        cx: pixels(circle.cx + 0.5),
        cy: pixels(circle.cy + 0.5),
        radius: pixels(circle.radius),
    }
}

/// Converts a default.
fn to_default(used: &DefaultUsed) -> ReportDefault {
    ReportDefault {
        name: used.name.into(),
        value: used.value.clone(),
        source: used.source.name().into(),
    }
}

/// Converts a warning.
pub(in crate::api) fn to_warning(warning: &Warning) -> ReportWarning {
    ReportWarning {
        code: warning.code.name().into(),
        message: warning.message.clone(),
    }
}

/// Converts a model.
fn to_model(model: &ModelUsed) -> ReportModel {
    ReportModel {
        name: model.name.clone(),
        revision: model.revision.clone(),
    }
}

/// Converts a person.
fn to_person(person: &pipeline::Person) -> ReportPerson {
    let [x_min, y_min, x_max, y_max] = person.bbox.corners().map(pixels);
    ReportPerson {
        bbox: ReportBox {
            x_min,
            y_min,
            x_max,
            y_max,
        },
        score: share(person.score),
        oriented_box: oriented_box(&person.oriented_box),
        bearing: person.bearing.map(|bearing| ReportBearing {
            azimuth_deg: azimuth_degrees(bearing.azimuth),
            off_axis_deg: degrees(bearing.off_axis),
        }),
        floor: person.floor.map(floor),
        height_m: person.height.map(|height| meters(height.height_m)),
        height_sd_m: person.height.map(|height| meters(height.sd_m)),
        posture: person.posture.0.name().into(),
        posture_probability: share(person.posture.1),
        floor_votes: person.floor_votes.map(|votes| ReportFloorVotes {
            lying: share(votes.lying),
            low: share(votes.low),
        }),
        views: person.views,
        zones: person.zones.clone(),
    }
}

/// Converts a zone.
fn to_zone(zone: &pipeline::ZoneCount) -> ReportZone {
    ReportZone {
        name: zone.name.clone(),
        persons: zone.persons,
    }
}

/// Converts the timings.
pub(in crate::api) fn to_timings(timings: &pipeline::StageTimings) -> ReportTimings {
    ReportTimings {
        decode: milliseconds(timings.decode),
        calibrate: milliseconds(timings.calibrate),
        queue: milliseconds(timings.queue),
        remap: milliseconds(timings.remap),
        inference: milliseconds(timings.inference),
        refine: milliseconds(timings.refine),
        total: milliseconds(timings.total),
    }
}

pub(in crate::api) const SERVER_TIMING: HeaderName = HeaderName::from_static("server-timing");
pub(in crate::api) const PERSON_COUNT: HeaderName = HeaderName::from_static("x-person-count");

/// Returns the headers about a report: the number of persons, and the stages as
/// `Server-Timing: decode;dur=3.1, …, total;dur=412.0` (W3C), milliseconds.
pub(in crate::api) fn report_headers(report: &DetectionReport) -> [(HeaderName, HeaderValue); 2] {
    let timings = to_timings(&report.timings);
    let stages = timings
        .stages()
        .map(|(stage, millis)| format!("{stage};dur={millis}"));
    // Names and numbers are visible ASCII.
    let stages = stages.join(", ").parse();
    let stages = stages.unwrap_or(HeaderValue::from_static(""));
    let count = HeaderValue::from(report.persons.len());
    [(SERVER_TIMING, stages), (PERSON_COUNT, count)]
}
