//! Label Studio: a list of tasks with predictions, as its import reads them. The labeling
//! configuration has `<Image name="image" value="$image"/>` and `<RectangleLabels name="label"
//! toName="image">`, as in the template for object detection.
//!
//! Positions are percentages of the image's sides. An oriented box has the position of its upper
//! left corner, about which it is rotated clockwise.

use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, utf8_percent_encode};
use serde_json::{Value, json};

use super::content::{
    AnnotatedBox, AnnotatedImage, BoxKind, FormatSpec, LABEL, Layout, SupportedBoxes, json_text,
};
use crate::rounding::{azimuth_degrees, share};

/// The format.
pub(super) const FORMAT: FormatSpec = FormatSpec {
    media_type: "application/x.label-studio+json",
    boxes: SupportedBoxes::Both,
    layout: Layout::OneFile {
        path: "tasks.json",
        document,
    },
};

/// The address of a file of Label Studio's local storage, before its encoded path.
const LOCAL_FILE: &str = "/data/local-files/?d=";
/// The characters that a path in a query does not have as themselves.
const ENCODED: &AsciiSet = &NON_ALPHANUMERIC
    .remove(b'/')
    .remove(b'-')
    .remove(b'.')
    .remove(b'_')
    .remove(b'~');

fn document(images: &[AnnotatedImage], boxes: BoxKind) -> String {
    let tasks: Vec<_> = images.iter().map(|image| task(image, boxes)).collect();
    json_text(&json!(tasks))
}

/// Returns the task of an image. The score of its prediction is the lowest one of the boxes, by
/// which Label Studio can order tasks, and 1 without boxes.
fn task(image: &AnnotatedImage, boxes: BoxKind) -> Value {
    let path = utf8_percent_encode(&image.file_name, ENCODED);
    let (image_width, image_height) = (image.width.into(), image.height.into());
    let (mut regions, mut lowest_score) = (Vec::new(), 1.0_f64);
    for ((corners, person), number) in image.boxes().zip(1..) {
        let ([x, y, width, height], rotation) = match boxes {
            BoxKind::AxisParallel => (axis_parallel(corners), 0.0),
            BoxKind::Oriented => rotated(person),
        };
        let score = share(person.score);
        lowest_score = lowest_score.min(score);
        regions.push(json!({
            "id": format!("{LABEL}-{number}"),
            "type": "rectanglelabels",
            "from_name": "label",
            "to_name": "image",
            "original_width": image.width,
            "original_height": image.height,
            "image_rotation": 0,
            "value": {
                "x": percent(x, image_width),
                "y": percent(y, image_height),
                "width": percent(width, image_width),
                "height": percent(height, image_height),
                "rotation": rotation,
                "rectanglelabels": [LABEL],
            },
            "score": score,
        }));
    }
    json!({
        "data": {"image": format!("{LOCAL_FILE}{path}")},
        "predictions": [{"model_version": "lookdown", "score": lowest_score, "result": regions}],
    })
}

/// Returns left, top, width and height.
fn axis_parallel([left, top, right, bottom]: [f64; 4]) -> [f64; 4] {
    [left, top, right - left, bottom - top]
}

/// Returns the upper left corner, width and height of the oriented box, and its rotation in
/// degrees.
fn rotated(person: &AnnotatedBox) -> ([f64; 4], f64) {
    let oriented = &person.oriented_box;
    let [corner, ..] = oriented.corners();
    let turn = std::f64::consts::TAU;
    let rotation = azimuth_degrees(oriented.angle.rem_euclid(turn));
    (
        [corner.x, corner.y, oriented.width, oriented.height],
        rotation,
    )
}

/// Returns a length as a percentage of a side, with six decimals.
fn percent(length: f64, side: f64) -> f64 {
    (length / side * 1e8).round() / 1e6
}
