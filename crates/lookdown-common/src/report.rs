//! The report of a frame in the format of the API: degrees, milliseconds and rounded numbers. The
//! server writes it; the counts, evaluations and annotation formats read it or its parts.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Most bytes of a report as JSON: more than any report has.
pub const MAX_REPORT_BYTES: u64 = 8 << 20;

/// The persons in one frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(example = json!({
    "request_id": "0197a3c5-8f0e-7c3e-9a55-2f8e4b1d6c70",
    "camera": "lobby",
    "received_at": "2026-11-21T09:30:00.412Z",
    "captured_at": "2026-11-21T09:30:00Z",
    "calibration": {"id": "lobby", "revision": "9f86d081884c", "assumed": false},
    "image": {"width": 1680, "height": 1680},
    "model": {"name": "nanodet_g_views_416", "revision": "533d5d09acd0"},
    "crop_model": {"name": "nanodet_g_fisheye_416", "revision": "ee6466ba3497"},
    "profile": "quality",
    "refinement": {
        "name": "fusion", "score_threshold": 0.3, "iou_threshold": 0.5, "sigma": 0.3,
        "max_detections": 1000
    },
    "defaults": [{"name": "profile", "value": "quality", "source": "calibration"}],
    "search": "full",
    "views": {"inferred": 24, "unchanged": 0, "outside": 0, "masked": 0, "outside_areas": 0,
        "not_needed": 0},
    "persons": [{
        "box": {"x_min": 1102.41, "y_min": 700.08, "x_max": 1341.77, "y_max": 842.6},
        "score": 0.8731,
        "oriented_box": {
            "cx": 1222.9, "cy": 771.3, "width": 118.25, "height": 241.02, "angle_deg": 79.84
        },
        "bearing": {"azimuth_deg": 349.87, "off_axis_deg": 41.71},
        "floor": {"x_m": 1.873, "y_m": -0.334},
        "height_m": 1.74, "height_sd_m": 0.21, "posture": "upright", "posture_probability": 0.97,
        "views": 3,
        "zones": ["entrance"]
    }],
    "margin": [],
    "zones": [{"name": "entrance", "persons": 1}, {"name": "till", "persons": 0}],
    "timings_ms": {
        "decode": 11.204, "calibrate": 0.015, "queue": 0.061, "remap": 21.377,
        "inference": 580.902, "refine": 0.412, "total": 614.122
    },
    "warnings": []
}))]
pub struct Report {
    /// Identifies the request in logs; also in the header X-Request-Id.
    pub request_id: String,
    /// The camera of the frame; the calibration's ID unless the request named a camera.
    pub camera: String,
    /// Time at which the request arrived (RFC 3339).
    #[schema(format = DateTime)]
    pub received_at: String,
    /// Time at which the frame was captured, if the request stated it (RFC 3339).
    #[schema(format = DateTime)]
    pub captured_at: Option<String>,
    /// The calibration.
    pub calibration: ReportCalibration,
    /// The frame, its EXIF orientation applied.
    pub image: ReportImage,
    /// The model.
    pub model: ReportModel,
    /// The model of the upright crops; absent when they used no other model than `model`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub crop_model: Option<ReportModel>,
    /// The profile.
    pub profile: Cow<'static, str>,
    /// The refinement with all its parameters.
    pub refinement: ReportRefinement,
    /// The parameters whose values were defaults of the calibration or the server; absent if the
    /// request and the built-in defaults gave all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(required = false)]
    pub defaults: Vec<ReportDefault>,
    /// The origin of the persons: `full` is a search of the views of the profile. With `follow`,
    /// `followed` means crops where the persons of the frame before were expected. `unchanged`
    /// means that nothing had moved, so that detections of earlier frames were reused.
    pub search: Cow<'static, str>,
    /// The numbers of views by outcome.
    pub views: ReportViews,
    /// Persons, highest score first.
    pub persons: Vec<ReportPerson>,
    /// People in the margin around the areas of the calibration, for tracking across their edges.
    /// They are in no number; absent without areas.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub margin: Option<Vec<ReportPerson>>,
    /// Number of persons in each zone of the calibration, in its order; absent without zones.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub zones: Option<Vec<ReportZone>>,
    /// Duration of each stage. The stages are disjoint. Their sum is the total except for
    /// scheduling gaps.
    pub timings_ms: ReportTimings,
    /// Circumstances that the client should consider.
    pub warnings: Vec<ReportWarning>,
}

/// A parameter that the request did not give, with its default.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(example = json!({"name": "profile", "value": "fast", "source": "calibration"}))]
pub struct ReportDefault {
    /// The name of the parameter.
    pub name: Cow<'static, str>,
    /// The value, as a request would give it.
    pub value: String,
    /// The origin: `calibration` (its field `detect`) or `server` (the settings `detect.*`).
    pub source: Cow<'static, str>,
}

/// A circumstance that the client should consider.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(example = json!({
    "code": "frame-rotated",
    "message": "the frame was rotated according to its EXIF orientation; boxes are in pixels of the rotated frame"
}))]
pub struct ReportWarning {
    /// The code for programs; stable. Later versions may add codes.
    pub code: Cow<'static, str>,
    /// The circumstance with its values, as one sentence for people.
    pub message: String,
}

/// The model of a report.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ReportModel {
    /// The name.
    pub name: String,
    /// The revision; it changes with the weights.
    pub revision: String,
}

/// The method that merges overlapping boxes into persons.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ReportRefinement {
    /// `nms`, `soft_nms_linear`, `soft_nms_gaussian` or `fusion`.
    pub name: Cow<'static, str>,
    /// Least score; persons with a lower one are omitted.
    pub score_threshold: f64,
    /// Least overlap (IoU) of boxes that are merged into one person.
    pub iou_threshold: f64,
    /// σ of Gaussian Soft-NMS.
    pub sigma: f64,
    /// Largest number of persons in a report.
    pub max_detections: usize,
}

/// The numbers of views by outcome.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ReportViews {
    /// Views that the model processed.
    pub inferred: usize,
    /// Views without motion since the model processed them: their detections are reused.
    pub unchanged: usize,
    /// Views outside the lens image.
    pub outside: usize,
    /// Views that the masks of the calibration hide completely.
    pub masked: usize,
    /// Views that cannot show a person in an area of the calibration.
    pub outside_areas: usize,
    /// Narrow views where the wide ones show no possible person.
    pub not_needed: usize,
}

/// A zone of the calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ReportZone {
    /// The name.
    pub name: String,
    /// Number of persons in the zone; a person may be in several zones.
    pub persons: usize,
}

/// One person.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ReportPerson {
    /// Axis-aligned box.
    #[serde(rename = "box")]
    pub bbox: ReportBox,
    /// Confidence, 0 to 1.
    pub score: f64,
    /// The box rotated so that its height axis is the projected vertical, or the body of a person
    /// who lies, with `floor`.
    pub oriented_box: ReportOrientedBox,
    /// Direction of the box center; null outside the lens image.
    pub bearing: Option<ReportBearing>,
    /// Position of the person on the floor; null when the height of the camera is unknown.
    pub floor: Option<ReportFloor>,
    /// Height of the person above the floor in meters; absent when the height of the camera is
    /// unknown, below the camera, far away, and of a person who lies.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub height_m: Option<f64>,
    /// Standard deviation of `height_m` in meters.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub height_sd_m: Option<f64>,
    /// `upright`, `seated`, `low`, `lying` or `unknown`, as far as one frame tells.
    #[serde(default = "unknown")]
    pub posture: Cow<'static, str>,
    /// Probability of the most likely posture; below 0.5 the posture is `unknown`.
    #[serde(default)]
    pub posture_probability: f64,
    /// Votes for a person on the floor; absent if no network that tells postures looked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub floor_votes: Option<ReportFloorVotes>,
    /// Number of views that detected the person.
    pub views: usize,
    /// Names of the zones that contain the person's foot point; absent without zones.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub zones: Option<Vec<String>>,
}

impl ReportPerson {
    /// Returns true if the votes of a network tell that the person lies: the oriented box is along
    /// the body then.
    pub fn lies(&self) -> bool {
        self.floor_votes.is_some() && self.posture == "lying"
    }
}

/// The posture in reports of earlier versions.
fn unknown() -> Cow<'static, str> {
    Cow::Borrowed("unknown")
}

/// Mean votes of the views for a person on the floor, 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ReportFloorVotes {
    /// For a person who lies.
    pub lying: f64,
    /// For a person who crouches, kneels, crawls or sits on the floor.
    pub low: f64,
}

/// Corner-origin frame pixels: a full frame is 0, 0, width, height.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ReportBox {
    /// Left edge.
    pub x_min: f64,
    /// Top edge.
    pub y_min: f64,
    /// Right edge.
    pub x_max: f64,
    /// Bottom edge.
    pub y_max: f64,
}

/// Wall-clock durations, milliseconds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ReportTimings {
    /// Decoding of the file to pixels.
    pub decode: f64,
    /// Selection of the camera: calibration, lens circle, and lookup tables on first use.
    pub calibrate: f64,
    /// Waiting for a worker and for the model.
    pub queue: f64,
    /// Rendering of the model input from the frame.
    pub remap: f64,
    /// Inference.
    pub inference: f64,
    /// Back-projection and merging.
    pub refine: f64,
    /// From the complete request in memory to the report.
    pub total: f64,
}

impl ReportTimings {
    /// Returns every stage by name, the total last.
    pub fn stages(&self) -> [(&'static str, f64); 7] {
        [
            ("decode", self.decode),
            ("calibrate", self.calibrate),
            ("queue", self.queue),
            ("remap", self.remap),
            ("inference", self.inference),
            ("refine", self.refine),
            ("total", self.total),
        ]
    }
}

/// The calibration of a report.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ReportCalibration {
    /// The ID; `assumed` when the request named no calibration.
    pub id: String,
    /// The revision; it changes with the content.
    pub revision: String,
    /// `true` if the request named no calibration and the lens was assumed.
    pub assumed: bool,
    /// The lens circle of the frame, from which the lens was assumed; absent with a calibration.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub assumed_circle: Option<ReportCircle>,
}

/// A lens circle, in pixels of the frame: the corner of the top-left pixel is (0, 0), as in boxes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = LensCircle)]
pub struct ReportCircle {
    /// Column of the center.
    pub cx: f64,
    /// Row of the center.
    pub cy: f64,
    /// Radius; the circle may reach beyond the frame.
    pub radius: f64,
}

/// The frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct ReportImage {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
}

/// Corner-origin frame pixels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ReportOrientedBox {
    /// Horizontal position of the center.
    pub cx: f64,
    /// Vertical position of the center.
    pub cy: f64,
    /// Extent across the height axis.
    pub width: f64,
    /// Extent along the height axis.
    pub height: f64,
    /// Clockwise rotation of the height axis from image up, −90 to 90.
    pub angle_deg: f64,
}

/// A direction from the camera.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ReportBearing {
    /// 0 toward image right, growing clockwise on the screen, 0 to 360.
    pub azimuth_deg: f64,
    /// Angle from the optical axis.
    pub off_axis_deg: f64,
}

/// A position on the floor: origin below the camera, x toward image right and y toward image down
/// of a camera that points straight down.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ReportFloor {
    /// Meters.
    pub x_m: f64,
    /// Meters.
    pub y_m: f64,
}
