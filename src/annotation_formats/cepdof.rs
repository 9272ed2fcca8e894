//! CEPDOF, the format of data sets of overhead fisheye cameras, which RAPiD reads: COCO, but with
//! `bbox` as `[cx, cy, width, height, angle]`, in pixels and degrees clockwise from image up.

use serde_json::{Value, json};

use super::{
    coco,
    content::{AnnotatedBox, FormatSpec, Layout, SupportedBoxes},
};
use crate::rounding::{degrees, pixels};

/// The format.
pub(super) const FORMAT: FormatSpec = FormatSpec {
    media_type: "application/x.cepdof+json",
    boxes: SupportedBoxes::Oriented,
    layout: Layout::OneFile {
        path: "annotations.json",
        document: |images, _| coco::document(images, shape),
    },
};

fn shape(_clipped: [f64; 4], person: &AnnotatedBox) -> Value {
    let oriented = &person.oriented_box;
    let [cx, cy] = [oriented.center.x, oriented.center.y].map(pixels);
    let [width, height] = [oriented.width, oriented.height].map(pixels);
    json!({
        "bbox": [cx, cy, width, height, degrees(oriented.angle)],
        "area": pixels(width * height),
    })
}
