//! COCO detection: one JSON document. Besides COCO's keys it has `score` and `oriented_box` for
//! each annotation and `calibration` for each image, which `lookdown eval` reads.

use lookdown_common::report::ReportOrientedBox;
use serde::Serialize;

use super::{
    AnnotatedBox, AnnotatedImage, BoxKind, FormatSpec, LABEL, Layout, SupportedBoxes,
    content::ImageMembers,
};
use crate::rounding::{oriented_box, pixels, share};

/// The format.
pub(super) const FORMAT: FormatSpec = FormatSpec {
    media_type: "application/x.coco+json",
    boxes: SupportedBoxes::AxisParallel,
    layout: Layout::OneFile {
        path: "annotations.json",
        document,
    },
};

/// The category ID of `person` in COCO.
const PERSON: u64 = 1;

#[derive(Serialize)]
struct Document<'a, Shape> {
    images: Vec<Image<'a>>,
    annotations: Vec<Annotation<Shape>>,
    categories: [Category; 1],
}

#[derive(Serialize)]
struct Image<'a> {
    id: u64,
    #[serde(flatten)]
    members: ImageMembers<'a>,
}

#[derive(Serialize)]
struct Annotation<Shape> {
    id: u64,
    image_id: u64,
    category_id: u64,
    #[serde(flatten)]
    shape: Shape,
    iscrowd: u8,
    /// Required by some tools, though there are no masks.
    segmentation: [f64; 0],
    score: f64,
}

/// The box of an annotation.
#[derive(Serialize)]
struct Shape {
    bbox: [f64; 4],
    area: f64,
    oriented_box: ReportOrientedBox,
}

#[derive(Serialize)]
struct Category {
    id: u64,
    name: &'static str,
    supercategory: &'static str,
}

fn document(images: &[AnnotatedImage], _boxes: BoxKind) -> String {
    document_of(images, shape)
}

/// Returns the document whose annotations have the keys of `shape` for each clipped box and person.
pub(super) fn document_of<Shape: Serialize>(
    images: &[AnnotatedImage],
    shape: fn([f64; 4], &AnnotatedBox) -> Shape,
) -> String {
    let mut document = Document {
        images: Vec::with_capacity(images.len()),
        annotations: Vec::new(),
        categories: [Category {
            id: PERSON,
            name: LABEL,
            supercategory: LABEL,
        }],
    };
    for (image_id, image) in (1..).zip(images) {
        document.images.push(Image {
            id: image_id,
            members: image.members(),
        });
        for (corners, person) in image.boxes() {
            let id = document.annotations.len() as u64 + 1;
            document.annotations.push(Annotation {
                id,
                image_id,
                category_id: PERSON,
                shape: shape(corners, person),
                iscrowd: 0,
                segmentation: [],
                score: share(person.score),
            });
        }
    }
    // Serializing numbers and strings in a fixed structure cannot fail.
    serde_json::to_string_pretty(&document).unwrap_or_default()
}

fn shape([left, top, right, bottom]: [f64; 4], person: &AnnotatedBox) -> Shape {
    let (width, height) = (pixels(right - left), pixels(bottom - top));
    Shape {
        bbox: [left, top, width, height],
        area: pixels(width * height),
        oriented_box: oriented_box(&person.oriented_box),
    }
}
