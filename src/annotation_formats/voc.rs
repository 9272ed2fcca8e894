//! Pascal VOC: an XML file per image, in `Annotations/`. Boxes are corner-origin pixels with two
//! decimals, as current annotation tools write and read them.

use serde::Serialize;

use super::{
    AnnotatedImage, BoxKind, FormatSpec, LABEL, Layout, SupportedBoxes, stem,
    xml::{self, Text},
};

/// The format.
pub(super) const FORMAT: FormatSpec = FormatSpec {
    media_type: "application/xml",
    boxes: SupportedBoxes::AxisParallel,
    layout: Layout::FilePerImage {
        path,
        document,
        others: Vec::new,
    },
};

/// The number of channels of every image.
const DEPTH: u8 = 3;

#[derive(Serialize)]
struct Annotation {
    folder: Text,
    filename: Text,
    size: Size,
    segmented: u8,
    object: Vec<Object>,
}

#[derive(Serialize)]
struct Size {
    width: u32,
    height: u32,
    depth: u8,
}

#[derive(Serialize)]
struct Object {
    name: &'static str,
    pose: &'static str,
    truncated: u8,
    difficult: u8,
    bndbox: Bndbox,
}

#[derive(Serialize)]
struct Bndbox {
    xmin: String,
    ymin: String,
    xmax: String,
    ymax: String,
}

/// The path of an image's file.
fn path(image_file_name: &str) -> String {
    format!("Annotations/{}.xml", stem(image_file_name))
}

fn document(image: &AnnotatedImage, _boxes: BoxKind) -> String {
    let (folder, name) = image
        .file_name
        .rsplit_once('/')
        .unwrap_or(("", &image.file_name));
    let objects = image.boxes().map(|(corners, _)| {
        let [xmin, ymin, xmax, ymax] = corners.map(|side| format!("{side:.2}"));
        Object {
            name: LABEL,
            pose: "Unspecified",
            truncated: 0,
            difficult: 0,
            bndbox: Bndbox {
                xmin,
                ymin,
                xmax,
                ymax,
            },
        }
    });
    let annotation = Annotation {
        folder: folder.into(),
        filename: name.into(),
        size: Size {
            width: image.width,
            height: image.height,
            depth: DEPTH,
        },
        segmented: 0,
        object: objects.collect(),
    };
    xml::document("annotation", &annotation)
}
