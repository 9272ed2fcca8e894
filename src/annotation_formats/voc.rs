//! Pascal VOC: an XML file per image, in `Annotations/`. Boxes are corner-origin pixels with two
//! decimals, as current annotation tools write and read them.

use super::{AnnotatedImage, LABEL, stem, xml::Xml};

/// The path of an image's file.
pub(super) fn path(image_file_name: &str) -> String {
    format!("Annotations/{}.xml", stem(image_file_name))
}

pub(super) fn document(image: &AnnotatedImage) -> String {
    let (folder, name) = match image.file_name.rsplit_once('/') {
        Some((folder, name)) => (folder, name),
        None => ("", image.file_name.as_str()),
    };
    let mut xml = Xml::document();
    xml.open("annotation", &[]);
    xml.text("folder", folder);
    xml.text("filename", name);
    xml.open("size", &[]);
    xml.text("width", &image.width.to_string());
    xml.text("height", &image.height.to_string());
    xml.text("depth", "3");
    xml.close("size");
    xml.text("segmented", "0");
    for (corners, _) in image.boxes() {
        xml.open("object", &[]);
        xml.text("name", LABEL);
        xml.text("pose", "Unspecified");
        xml.text("truncated", "0");
        xml.text("difficult", "0");
        xml.open("bndbox", &[]);
        for (side, value) in ["xmin", "ymin", "xmax", "ymax"].into_iter().zip(corners) {
            xml.text(side, &format!("{value:.2}"));
        }
        xml.close("bndbox");
        xml.close("object");
    }
    xml.close("annotation");
    xml.finish()
}
