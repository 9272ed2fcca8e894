//! Converts the report of the pipeline to the units and decimals of the API.

use lookdown_common::report::ReportCircle;
use lookdown_detect::{
    imaging::lens_circle::LensCircle,
    parameters::DefaultUsed,
    pipeline::{self, DetectionReport, ModelUsed},
};
use lookdown_lens::warning::Warning;

use super::{
    Report, ReportBearing, ReportBox, ReportCalibration, ReportDefault, ReportImage, ReportModel,
    ReportPerson, ReportRefinement, ReportTimings, ReportViews, ReportWarning, ReportZone,
};
use crate::rounding::{
    azimuth_degrees, degrees, floor, meters, milliseconds, oriented_box, pixels, share,
};

impl From<&DetectionReport> for Report {
    fn from(report: &DetectionReport) -> Self {
        let refinement = &report.refinement;
        Self {
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
            model: ReportModel::from(&report.model),
            crop_model: report.crop_model.as_ref().map(ReportModel::from),
            profile: report.profile.name(),
            refinement: ReportRefinement {
                name: refinement.refinement.name(),
                score_threshold: refinement.score_threshold,
                iou_threshold: refinement.iou_threshold,
                sigma: refinement.sigma,
                max_detections: refinement.max_detections,
            },
            defaults: report.defaults.iter().map(ReportDefault::from).collect(),
            search: report.search.name(),
            views: ReportViews {
                inferred: report.views.inferred,
                unchanged: report.views.unchanged,
                outside: report.views.outside,
                masked: report.views.masked,
                outside_areas: report.views.outside_areas,
            },
            persons: report.persons.iter().map(ReportPerson::from).collect(),
            margin: report.margin.as_ref().map(|margin| {
                let margin = margin.iter();
                margin.map(ReportPerson::from).collect()
            }),
            zones: (!report.zones.is_empty()).then(|| {
                let zones = report.zones.iter();
                zones.map(ReportZone::from).collect()
            }),
            timings_ms: ReportTimings::from(&report.timings),
            warnings: report.warnings.iter().map(ReportWarning::from).collect(),
        }
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

impl From<&DefaultUsed> for ReportDefault {
    fn from(used: &DefaultUsed) -> Self {
        Self {
            name: used.name,
            value: used.value.clone(),
            source: used.source.name(),
        }
    }
}

impl From<&Warning> for ReportWarning {
    fn from(warning: &Warning) -> Self {
        Self {
            code: warning.code.name(),
            message: warning.message.clone(),
        }
    }
}

impl From<&ModelUsed> for ReportModel {
    fn from(model: &ModelUsed) -> Self {
        Self {
            name: model.name.clone(),
            revision: model.revision.clone(),
        }
    }
}

impl From<&pipeline::Person> for ReportPerson {
    fn from(person: &pipeline::Person) -> Self {
        let [x_min, y_min, x_max, y_max] = person.bbox.corners().map(pixels);
        Self {
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
            views: person.views,
            zones: person.zones.clone(),
        }
    }
}

impl From<&pipeline::ZoneCount> for ReportZone {
    fn from(zone: &pipeline::ZoneCount) -> Self {
        Self {
            name: zone.name.clone(),
            persons: zone.persons,
        }
    }
}

impl From<&pipeline::StageTimings> for ReportTimings {
    fn from(timings: &pipeline::StageTimings) -> Self {
        Self {
            decode: milliseconds(timings.decode),
            calibrate: milliseconds(timings.calibrate),
            queue: milliseconds(timings.queue),
            remap: milliseconds(timings.remap),
            inference: milliseconds(timings.inference),
            refine: milliseconds(timings.refine),
            total: milliseconds(timings.total),
        }
    }
}
