//! The report as it is sent: degrees, milliseconds, and no more digits than mean something.

mod conversion;
mod rounding;

pub(super) use rounding::pixels;

use serde::Serialize;
use utoipa::ToSchema;

/// The persons in one frame.
#[derive(Debug, Clone, Serialize, ToSchema)]
#[schema(example = json!({
    "request_id": "0197a3c5-8f0e-7c3e-9a55-2f8e4b1d6c70",
    "camera": "lobby",
    "received_at": "2026-11-21T09:30:00.412Z",
    "captured_at": "2026-11-21T09:30:00Z",
    "calibration": {"id": "lobby", "revision": "9f86d081884c", "assumed": false},
    "image": {"width": 1680, "height": 1680},
    "model": {"name": "nanodet_g_416", "revision": "a3c2e9b54d10"},
    "second_opinion": {"name": "ssdlite_mobilenet_v2_int8", "revision": "60303ae22b99"},
    "profile": "quality",
    "refinement": {
        "name": "fusion", "score_threshold": 0.3, "iou_threshold": 0.5, "sigma": 0.3,
        "max_detections": 1000
    },
    "views": {"inferred": 24, "unchanged": 0, "outside": 0, "masked": 0},
    "persons": [{
        "box": {"x_min": 1102.41, "y_min": 700.08, "x_max": 1341.77, "y_max": 842.6},
        "score": 0.8731,
        "oriented_box": {
            "cx": 1222.9, "cy": 771.3, "width": 118.25, "height": 241.02, "angle_deg": 79.84
        },
        "bearing": {"azimuth_deg": 349.87, "off_axis_deg": 41.71},
        "floor": {"x_m": 1.873, "y_m": -0.334},
        "views": 3,
        "zones": ["entrance"]
    }],
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
    /// Which camera the frame came from; the calibration's ID unless the request named one.
    pub camera: String,
    /// When the request arrived (RFC 3339).
    #[schema(format = DateTime)]
    pub received_at: String,
    /// When the frame was taken, if the request said so (RFC 3339).
    #[schema(format = DateTime)]
    pub captured_at: Option<String>,
    /// The calibration used.
    pub calibration: ReportCalibration,
    /// The frame, its EXIF orientation applied.
    pub image: ReportImage,
    /// The detector used.
    pub model: ReportModel,
    /// The detector that took some of the closer looks; absent where nobody else was asked.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub second_opinion: Option<ReportModel>,
    /// The profile used.
    pub profile: &'static str,
    /// The refinement used, with all its parameters.
    pub refinement: ReportRefinement,
    /// What became of the views.
    pub views: ReportViews,
    /// Persons, highest score first.
    pub persons: Vec<ReportPerson>,
    /// How many of them are in each zone of the calibration, in its order; absent when it has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub zones: Option<Vec<ReportZone>>,
    /// Where the time went. The stages are disjoint; together they make the total but for
    /// scheduling gaps.
    pub timings_ms: ReportTimings,
    /// Circumstances that the client should consider.
    pub warnings: Vec<ReportWarning>,
}

/// The calibration used.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct ReportCalibration {
    /// Its ID; `assumed` when none was named.
    pub id: String,
    /// Changes whenever its content does.
    pub revision: String,
    /// Whether the lens was assumed because the request named no calibration.
    pub assumed: bool,
    /// The lens circle of the frame, from which the lens was assumed; absent with a calibration.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub assumed_circle: Option<ReportCircle>,
}

/// A lens circle, in pixels of the frame: the corner of the top-left pixel is (0, 0), as in boxes.
#[derive(Debug, Clone, Serialize, ToSchema)]
#[schema(as = LensCircle)]
pub struct ReportCircle {
    /// Column of the centre.
    pub cx: f64,
    /// Row of the centre.
    pub cy: f64,
    /// Radius; the circle may reach beyond the frame.
    pub radius: f64,
}

/// A circumstance that the client should consider.
#[derive(Debug, Clone, Serialize, ToSchema)]
#[schema(example = json!({
    "code": "frame-rotated",
    "message": "the frame was rotated according to its EXIF orientation; boxes are in pixels of the rotated frame"
}))]
pub struct ReportWarning {
    /// The code for programs; stable. Later versions may add codes.
    pub code: &'static str,
    /// The circumstance with its values, as one sentence for people.
    pub message: String,
}

/// The frame.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct ReportImage {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
}

/// The detector used.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct ReportModel {
    /// Its name.
    pub name: String,
    /// Changes whenever its weights do.
    pub revision: String,
}

/// How overlapping boxes became persons.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct ReportRefinement {
    /// `nms`, `soft_nms_linear`, `soft_nms_gaussian` or `fusion`.
    pub name: &'static str,
    /// Persons with a lower score are left out.
    pub score_threshold: f64,
    /// Boxes that overlap at least this much are the same person.
    pub iou_threshold: f64,
    /// σ of Gaussian Soft-NMS.
    pub sigma: f64,
    /// Most persons in a report.
    pub max_detections: usize,
}

/// What became of the views.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct ReportViews {
    /// The detector looked at these.
    pub inferred: usize,
    /// Nothing had moved in these since they were looked at: what was found in them stands.
    pub unchanged: usize,
    /// These lie outside the lens image.
    pub outside: usize,
    /// These see nothing but what the calibration's masks hide.
    pub masked: usize,
}

/// A zone of the calibration.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct ReportZone {
    /// Its name.
    pub name: String,
    /// How many persons are in it; one may be in several zones.
    pub persons: usize,
}

/// One person.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct ReportPerson {
    /// Axis-parallel box.
    #[serde(rename = "box")]
    pub bbox: ReportBox,
    /// Confidence, 0 to 1.
    pub score: f64,
    /// The box turned so that its height axis is the projected vertical.
    pub oriented_box: ReportOrientedBox,
    /// The direction of the box centre; null when it lies outside the lens image.
    pub bearing: Option<ReportBearing>,
    /// Where the person stands; null when the camera's height is unknown.
    pub floor: Option<ReportFloor>,
    /// How many views agreed.
    pub views: usize,
    /// The names of the zones that the person's foot is in; absent when the calibration has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub zones: Option<Vec<String>>,
}

/// Corner-origin frame pixels: a full frame is 0, 0, width, height.
#[derive(Debug, Clone, Serialize, ToSchema)]
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

/// Corner-origin frame pixels.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct ReportOrientedBox {
    /// Centre, to the right.
    pub cx: f64,
    /// Centre, down.
    pub cy: f64,
    /// Extent across the height axis.
    pub width: f64,
    /// Extent along the height axis.
    pub height: f64,
    /// Clockwise rotation of the height axis from image up, −90 to 90.
    pub angle_deg: f64,
}

/// A direction as seen from the camera.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct ReportBearing {
    /// 0 toward image right, growing clockwise on the screen, 0 to 360.
    pub azimuth_deg: f64,
    /// Angle from the optical axis.
    pub off_axis_deg: f64,
}

/// A place on the floor: origin below the camera, x toward image right and y toward image down of
/// a camera that looks straight down.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct ReportFloor {
    /// Metres.
    pub x_m: f64,
    /// Metres.
    pub y_m: f64,
}

/// Wall-clock spans, milliseconds.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct ReportTimings {
    /// Bytes to pixels.
    pub decode: f64,
    /// Finding the camera: calibration, lens circle, tables when they are new.
    pub calibrate: f64,
    /// Waiting for a worker and for the network.
    pub queue: f64,
    /// Frame to network input.
    pub remap: f64,
    /// The network.
    pub inference: f64,
    /// Back-projection and merge.
    pub refine: f64,
    /// From the whole request in memory to the report.
    pub total: f64,
}

impl ReportTimings {
    /// Every stage by name, and last the total.
    pub(super) fn stages(&self) -> [(&'static str, f64); 7] {
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
