//! CVAT for images 1.1: one XML document. An oriented box is written unrotated, with its clockwise
//! `rotation` about its center in degrees, from 0 to below 360.

use lookdown_lens::geometry::OrientedBox;
use serde::Serialize;

use super::{
    AnnotatedImage, BoxKind, FormatSpec, LABEL, Layout, SupportedBoxes,
    xml::{self, Text},
};
use crate::rounding::{pixels, share};

#[derive(Serialize)]
struct Annotations {
    version: &'static str,
    meta: Meta,
    image: Vec<Image>,
}

/// The format.
pub(super) const FORMAT: FormatSpec = FormatSpec {
    media_type: "application/xml",
    boxes: SupportedBoxes::Both,
    layout: Layout::OneFile {
        path: "annotations.xml",
        document,
    },
};

/// The label, which makes the classes of the file explicit.
#[derive(Serialize)]
struct Meta {
    task: Task,
}

/// Importers expect a task or a project here.
#[derive(Serialize)]
struct Task {
    labels: Labels,
}

#[derive(Serialize)]
struct Labels {
    label: Label,
}

#[derive(Serialize)]
struct Label {
    name: &'static str,
    attributes: Attributes,
}

#[derive(Serialize)]
struct Attributes {
    attribute: AttributeType,
}

#[derive(Serialize)]
struct AttributeType {
    name: &'static str,
    mutable: &'static str,
    input_type: &'static str,
    default_value: &'static str,
    values: &'static str,
}

#[derive(Serialize)]
struct Image {
    #[serde(rename = "@id")]
    id: usize,
    #[serde(rename = "@name")]
    name: Text,
    #[serde(rename = "@width")]
    width: u32,
    #[serde(rename = "@height")]
    height: u32,
    #[serde(rename = "box")]
    shapes: Vec<Shape>,
}

#[derive(Serialize)]
struct Shape {
    #[serde(rename = "@label")]
    label: &'static str,
    #[serde(rename = "@source")]
    source: &'static str,
    #[serde(rename = "@occluded")]
    occluded: u8,
    #[serde(rename = "@xtl")]
    left: String,
    #[serde(rename = "@ytl")]
    top: String,
    #[serde(rename = "@xbr")]
    right: String,
    #[serde(rename = "@ybr")]
    bottom: String,
    #[serde(rename = "@z_order")]
    z_order: u8,
    #[serde(rename = "@rotation", skip_serializing_if = "Option::is_none")]
    rotation: Option<String>,
    attribute: Attribute,
}

#[derive(Serialize)]
struct Attribute {
    #[serde(rename = "@name")]
    name: &'static str,
    #[serde(rename = "$text")]
    value: f64,
}

fn document(images: &[AnnotatedImage], boxes: BoxKind) -> String {
    let images = images.iter().enumerate().map(|(id, image)| {
        let shapes = image.boxes().map(|(corners, person)| {
            let (corners, rotation) = match boxes {
                BoxKind::AxisParallel => (corners, None),
                BoxKind::Oriented => unturned(&person.oriented_box),
            };
            shape(corners, rotation, person.score)
        });
        Image {
            id,
            name: image.file_name.as_str().into(),
            width: image.width,
            height: image.height,
            shapes: shapes.collect(),
        }
    });
    let attribute = AttributeType {
        name: "score",
        mutable: "False",
        input_type: "text",
        default_value: "",
        values: "",
    };
    let label = Label {
        name: LABEL,
        attributes: Attributes { attribute },
    };
    let annotations = Annotations {
        version: "1.1",
        meta: Meta {
            task: Task {
                labels: Labels { label },
            },
        },
        image: images.collect(),
    };
    xml::document("annotations", &annotations)
}

fn shape(corners: [f64; 4], rotation: Option<f64>, score: f64) -> Shape {
    let [left, top, right, bottom] = corners.map(|side| format!("{side:.2}"));
    Shape {
        label: LABEL,
        source: "auto",
        occluded: 0,
        left,
        top,
        right,
        bottom,
        z_order: 0,
        rotation: rotation.map(|degrees| format!("{degrees:.2}")),
        attribute: Attribute {
            name: "score",
            value: share(score),
        },
    }
}

/// The corners of the unrotated box, and its rotation in degrees.
fn unturned(oriented: &OrientedBox) -> ([f64; 4], Option<f64>) {
    let (x, y) = (oriented.center.x, oriented.center.y);
    let (half_width, half_height) = (oriented.width / 2.0, oriented.height / 2.0);
    let degrees = pixels(oriented.angle.to_degrees().rem_euclid(360.0));
    let corners = [
        x - half_width,
        y - half_height,
        x + half_width,
        y + half_height,
    ];
    let below_a_turn = if degrees < 360.0 { degrees } else { 0.0 };
    (corners.map(pixels), Some(below_a_turn))
}
