//! The fields of reports that do not matter to tests.

/// The fields of a report without camera, times, calibration, image and persons.
pub const OF_REPORT: &str = r#""request_id": "x", "model": {"name": "person", "revision": "1"},
    "profile": "fast", "refinement": {"name": "nms", "score_threshold": 0.3, "iou_threshold": 0.5,
    "sigma": 0.3, "max_detections": 1000}, "search": "full", "views": {"inferred": 1, "unchanged": 0,
    "outside": 0, "masked": 0, "outside_areas": 0, "not_needed": 0}, "timings_ms": {"decode": 1,
    "calibrate": 1, "queue": 1, "remap": 1, "inference": 1, "refine": 1, "total": 6}, "warnings": []"#;
/// The fields of a person without score, oriented box, bearing and floor.
pub const OF_PERSON: &str =
    r#""box": {"x_min": 1, "y_min": 1, "x_max": 2, "y_max": 2}, "views": 2"#;
