//! COCO detection: one JSON document. Besides COCO's keys it has `score` and `oriented_box` for
//! each annotation and `calibration` for each image, which `lookdown eval` reads.

use serde_json::{Value, json};

use super::content::{
    AnnotatedBox, AnnotatedImage, FormatSpec, LABEL, Layout, SupportedBoxes, json_text,
};
use crate::rounding::{oriented_box, pixels, share};

/// The format.
pub(super) const FORMAT: FormatSpec = FormatSpec {
    media_type: "application/x.coco+json",
    boxes: SupportedBoxes::AxisParallel,
    layout: Layout::OneFile {
        path: "annotations.json",
        document: |images, _| document(images, shape),
    },
};

/// The category ID of `person` in COCO.
const PERSON: u64 = 1;

/// Returns the document whose annotations have the keys of `shape` for each clipped box and person.
pub(super) fn document(
    images: &[AnnotatedImage],
    shape: fn([f64; 4], &AnnotatedBox) -> Value,
) -> String {
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

fn shape([left, top, right, bottom]: [f64; 4], person: &AnnotatedBox) -> Value {
    let (width, height) = (pixels(right - left), pixels(bottom - top));
    json!({
        "bbox": [left, top, width, height],
        "area": pixels(width * height),
        "oriented_box": oriented_box(&person.oriented_box),
    })
}
