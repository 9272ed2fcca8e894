//! Formats that are JSON documents.

use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, utf8_percent_encode};
use serde_json::{Value, json};

use super::content::{
    AnnotatedBox, AnnotatedImage, BoxKind, FormatSpec, LABEL, Layout, SupportedBoxes, stem,
};
use crate::rounding::{azimuth_degrees, degrees, floor, oriented_box, pixels, share};

/// COCO detection: one JSON document. Besides COCO's keys it has `score` and `oriented_box` for
/// each annotation and `calibration` for each image, which `lookdown eval` reads.
pub(super) const COCO: FormatSpec = FormatSpec {
    media_type: "application/x.coco+json",
    boxes: SupportedBoxes::AxisParallel,
    layout: Layout::OneFile {
        path: "annotations.json",
        document: |images, _| coco_document(images, coco_shape),
    },
};

/// The category ID of `person` in COCO.
const PERSON: u64 = 1;

/// Returns the document whose annotations have the keys of `shape` for each clipped box and person.
fn coco_document(images: &[AnnotatedImage], shape: fn([f64; 4], &AnnotatedBox) -> Value) -> String {
    let (mut rows, mut annotations) = (Vec::with_capacity(images.len()), Vec::new());
    for (image_id, image) in (1..).zip(images) {
        let mut row = image.members();
        row["id"] = json!(image_id);
        rows.push(row);
        for (corners, person) in image.boxes() {
            let mut annotation = shape(corners, person);
            annotation["id"] = json!(annotations.len() + 1);
            annotation["image_id"] = json!(image_id);
            annotation["category_id"] = json!(PERSON);
            annotation["iscrowd"] = json!(0);
            // Required by some tools, though there are no masks.
            annotation["segmentation"] = json!([]);
            annotation["score"] = json!(share(person.score));
            annotations.push(annotation);
        }
    }
    json_text(&json!({
        "images": rows,
        "annotations": annotations,
        "categories": [{"id": PERSON, "name": LABEL, "supercategory": LABEL}],
    }))
}

fn coco_shape([left, top, right, bottom]: [f64; 4], person: &AnnotatedBox) -> Value {
    let (width, height) = (pixels(right - left), pixels(bottom - top));
    json!({
        "bbox": [left, top, width, height],
        "area": pixels(width * height),
        "oriented_box": oriented_box(&person.oriented_box),
    })
}

/// CEPDOF, the format of data sets of overhead fisheye cameras, which RAPiD reads: COCO, but with
/// `bbox` as `[cx, cy, width, height, angle]`, in pixels and degrees clockwise from image up.
pub(super) const CEPDOF: FormatSpec = FormatSpec {
    media_type: "application/x.cepdof+json",
    boxes: SupportedBoxes::Oriented,
    layout: Layout::OneFile {
        path: "annotations.json",
        document: |images, _| coco_document(images, cepdof_shape),
    },
};

fn cepdof_shape(_clipped: [f64; 4], person: &AnnotatedBox) -> Value {
    let oriented = &person.oriented_box;
    let [cx, cy] = [oriented.center.x, oriented.center.y].map(pixels);
    let [width, height] = [oriented.width, oriented.height].map(pixels);
    json!({
        "bbox": [cx, cy, width, height, degrees(oriented.angle)],
        "area": pixels(width * height),
    })
}

/// GeoJSON (RFC 7946): a feature collection per image. The geometry of a person is its oriented
/// box. Positions are corner-origin frame pixels, x to the right and y down, as image tools read
/// them, not longitude and latitude. RFC 7946 permits this by prior agreement (section 4). The
/// person's position on the floor, in meters, is a property, and so is the axis-parallel `box`:
/// left, top, right, bottom. The member `image` is an addition to those of GeoJSON.
pub(super) const GEO_JSON: FormatSpec = FormatSpec {
    media_type: "application/geo+json",
    boxes: SupportedBoxes::Oriented,
    layout: Layout::FilePerImage {
        path: |image_file_name| format!("features/{}.geojson", stem(image_file_name)),
        document: |image, _| geo_json_document(image),
        others: |_| Vec::new(),
    },
};

fn geo_json_document(image: &AnnotatedImage) -> String {
    let features = image.boxes().zip(1..);
    let features = features.map(|((corners, person), id)| feature(id, corners, person));
    json_text(&json!({
        "type": "FeatureCollection",
        "image": image.members(),
        "features": features.collect::<Vec<_>>(),
    }))
}

/// Returns a person as a feature. Its ring repeats the first corner at the end. The corners are
/// counterclockwise with y upward, as RFC 7946 requires (section 3.1.6), and therefore clockwise in
/// the image.
fn feature(id: usize, corners: [f64; 4], person: &AnnotatedBox) -> Value {
    let oriented = &person.oriented_box;
    let foot = oriented.foot();
    let ring = oriented.corners().map(|at| [pixels(at.x), pixels(at.y)]);
    let [a, b, c, d] = ring;
    json!({
        "type": "Feature",
        "id": id,
        "geometry": {"type": "Polygon", "coordinates": [[a, b, c, d, a]]},
        "properties": {
            "label": LABEL,
            "score": share(person.score),
            "box": corners,
            "angle_deg": degrees(oriented.angle),
            "foot": [pixels(foot.x), pixels(foot.y)],
            "floor": person.floor.map(floor),
        },
    })
}

/// Label Studio: a list of tasks with predictions, as its import reads them. The labeling
/// configuration has `<Image name="image" value="$image"/>` and `<RectangleLabels name="label"
/// toName="image">`, as in the template for object detection.
///
/// Positions are percentages of the image's sides. An oriented box has the position of its upper
/// left corner, about which it is rotated clockwise.
pub(super) const LABEL_STUDIO: FormatSpec = FormatSpec {
    media_type: "application/x.label-studio+json",
    boxes: SupportedBoxes::Both,
    layout: Layout::OneFile {
        path: "tasks.json",
        document: label_studio_document,
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

fn label_studio_document(images: &[AnnotatedImage], boxes: BoxKind) -> String {
    let tasks: Vec<_> = images
        .iter()
        .map(|image| label_studio_task(image, boxes))
        .collect();
    json_text(&json!(tasks))
}

/// Returns the task of an image. The score of its prediction is the lowest one of the boxes, by
/// which Label Studio can order tasks, and 1 without boxes.
fn label_studio_task(image: &AnnotatedImage, boxes: BoxKind) -> Value {
    let path = utf8_percent_encode(&image.file_name, ENCODED);
    let (image_width, image_height) = (image.width.into(), image.height.into());
    let (mut regions, mut lowest_score) = (Vec::new(), 1.0_f64);
    for ((corners, person), number) in image.boxes().zip(1..) {
        let ([x, y, width, height], rotation) = match boxes {
            BoxKind::AxisParallel => (left_top_and_size(corners), 0.0),
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
fn left_top_and_size([left, top, right, bottom]: [f64; 4]) -> [f64; 4] {
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

/// Returns a JSON document as text. Serializing numbers and strings cannot fail.
fn json_text(document: &Value) -> String {
    serde_json::to_string_pretty(document).unwrap_or_default()
}
