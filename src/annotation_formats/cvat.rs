//! CVAT for images 1.1: one XML document. An oriented box is written unrotated, with its clockwise
//! `rotation` about its centre in degrees, from 0 to below 360.

use super::{AnnotatedImage, BoxKind, LABEL, pixels, share, xml::Xml};
use crate::geometry::OrientedBox;

pub(super) fn document(images: &[AnnotatedImage], boxes: BoxKind) -> String {
    let mut xml = Xml::document();
    xml.open("annotations", &[]);
    xml.text("version", "1.1");
    label(&mut xml);
    for (id, image) in images.iter().enumerate() {
        xml.open(
            "image",
            &[
                ("id", &id.to_string()),
                ("name", &image.file_name),
                ("width", &image.width.to_string()),
                ("height", &image.height.to_string()),
            ],
        );
        for (corners, person) in image.boxes() {
            let (corners, rotation) = match boxes {
                BoxKind::AxisParallel => (corners, None),
                BoxKind::Oriented => unturned(&person.oriented_box),
            };
            shape(&mut xml, corners, rotation, person.score);
        }
        xml.close("image");
    }
    xml.close("annotations");
    xml.finish()
}

/// The label, which makes the classes of the file explicit.
fn label(xml: &mut Xml) {
    for name in ["meta", "job", "labels", "label"] {
        xml.open(name, &[]);
    }
    xml.text("name", LABEL);
    xml.open("attributes", &[]);
    xml.open("attribute", &[]);
    for (name, value) in [
        ("name", "score"),
        ("mutable", "False"),
        ("input_type", "text"),
        ("default_value", ""),
        ("values", ""),
    ] {
        xml.text(name, value);
    }
    for name in ["attribute", "attributes", "label", "labels", "job", "meta"] {
        xml.close(name);
    }
}

fn shape(xml: &mut Xml, corners: [f64; 4], rotation: Option<f64>, score: f64) {
    let [left, top, right, bottom] = corners.map(|side| format!("{side:.2}"));
    let rotation = rotation.map(|degrees| format!("{degrees:.2}"));
    let mut attributes = vec![
        ("label", LABEL),
        ("source", "auto"),
        ("occluded", "0"),
        ("xtl", &left),
        ("ytl", &top),
        ("xbr", &right),
        ("ybr", &bottom),
        ("z_order", "0"),
    ];
    attributes.extend(
        rotation
            .as_ref()
            .map(|degrees| ("rotation", degrees.as_str())),
    );
    xml.open("box", &attributes);
    xml.element("attribute", &[("name", "score")], &share(score).to_string());
    xml.close("box");
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
