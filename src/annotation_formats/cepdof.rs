//! CEPDOF, the format of data sets of overhead fisheye cameras, which RAPiD reads: COCO, but with
//! `bbox` as `[cx, cy, width, height, angle]`, in pixels and degrees clockwise from image up.

use serde::Serialize;

use super::{
    AnnotatedBox, AnnotatedImage, BoxKind, FormatSpec, Layout, SupportedBoxes, coco::document_of,
};
use crate::rounding::{degrees, pixels};

/// The format.
pub(super) const FORMAT: FormatSpec = FormatSpec {
    media_type: "application/x.cepdof+json",
    boxes: SupportedBoxes::Oriented,
    layout: Layout::OneFile {
        path: "annotations.json",
        document,
    },
};

/// The box of an annotation.
#[derive(Serialize)]
struct Shape {
    bbox: [f64; 5],
    area: f64,
}

fn document(images: &[AnnotatedImage], _boxes: BoxKind) -> String {
    document_of(images, shape)
}

fn shape(_clipped: [f64; 4], person: &AnnotatedBox) -> Shape {
    let oriented = &person.oriented_box;
    let sides = [
        oriented.center.x,
        oriented.center.y,
        oriented.width,
        oriented.height,
    ];
    let [cx, cy, width, height] = sides.map(pixels);
    Shape {
        bbox: [cx, cy, width, height, degrees(oriented.angle)],
        area: pixels(width * height),
    }
}
