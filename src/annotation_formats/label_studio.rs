//! Label Studio: a list of tasks with predictions, as its import reads them. The labeling
//! configuration has `<Image name="image" value="$image"/>` and `<RectangleLabels name="label"
//! toName="image">`, as in the template for object detection.
//!
//! Positions are percentages of the image's sides. An oriented box has the position of its upper
//! left corner, about which it is rotated clockwise.

use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, utf8_percent_encode};
use serde::Serialize;

use super::{AnnotatedBox, AnnotatedImage, BoxKind, FormatSpec, LABEL, Layout, SupportedBoxes};
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

#[derive(Serialize)]
struct Task {
    data: Data,
    predictions: [Prediction; 1],
}

#[derive(Serialize)]
struct Data {
    image: String,
}

#[derive(Serialize)]
struct Prediction {
    model_version: &'static str,
    /// The lowest score of the boxes, by which Label Studio can order tasks; 1 without boxes.
    score: f64,
    result: Vec<Region>,
}

#[derive(Serialize)]
struct Region {
    id: String,
    r#type: &'static str,
    from_name: &'static str,
    to_name: &'static str,
    original_width: u32,
    original_height: u32,
    image_rotation: u8,
    value: Rectangle,
    score: f64,
}

#[derive(Serialize)]
struct Rectangle {
    x: f64,
    y: f64,
    width: f64,
    height: f64,
    rotation: f64,
    rectanglelabels: [&'static str; 1],
}

fn document(images: &[AnnotatedImage], boxes: BoxKind) -> String {
    let tasks: Vec<_> = images.iter().map(|image| task(image, boxes)).collect();
    // Serializing numbers and strings in a fixed structure cannot fail.
    serde_json::to_string_pretty(&tasks).unwrap_or_default()
}

fn task(image: &AnnotatedImage, boxes: BoxKind) -> Task {
    let path = utf8_percent_encode(&image.file_name, ENCODED);
    let regions = image.boxes().zip(1..).map(|((corners, person), number)| {
        let ([x, y, width, height], rotation) = match boxes {
            BoxKind::AxisParallel => (axis_parallel(corners), 0.0),
            BoxKind::Oriented => rotated(person),
        };
        let (image_width, image_height) = (image.width.into(), image.height.into());
        Region {
            id: format!("{LABEL}-{number}"),
            r#type: "rectanglelabels",
            from_name: "label",
            to_name: "image",
            original_width: image.width,
            original_height: image.height,
            image_rotation: 0,
            value: Rectangle {
                x: percent(x, image_width),
                y: percent(y, image_height),
                width: percent(width, image_width),
                height: percent(height, image_height),
                rotation,
                rectanglelabels: [LABEL],
            },
            score: share(person.score),
        }
    });
    let result: Vec<_> = regions.collect();
    let scores = result.iter().map(|region| region.score);
    Task {
        data: Data {
            image: format!("{LOCAL_FILE}{path}"),
        },
        predictions: [Prediction {
            model_version: "lookdown",
            score: scores.fold(1.0, f64::min),
            result,
        }],
    }
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
