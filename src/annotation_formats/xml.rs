//! Formats that are XML documents.

use std::fmt::Write;

use lookdown_lens::geometry::OrientedBox;
use quick_xml::escape::escape;

use super::content::{
    AnnotatedImage, AnnotationFile, BoxKind, FormatSpec, LABEL, Layout, SupportedBoxes, file, stem,
};
use crate::rounding::{pixels, share};

/// CVAT for images 1.1: one XML document. An oriented box is written unrotated, with its clockwise
/// `rotation` about its center in degrees, from 0 to below 360.
pub(super) const CVAT: FormatSpec = FormatSpec {
    media_type: "application/xml",
    boxes: SupportedBoxes::Both,
    layout: Layout::OneFile {
        path: "annotations.xml",
        document: cvat_document,
    },
};

fn cvat_document(images: &[AnnotatedImage], boxes: BoxKind) -> String {
    // Importers expect a task or a project; the label makes the classes of the file explicit.
    let mut text = format!(
        "{DECLARATION}<annotations>
  <version>1.1</version>
  <meta>
    <task>
      <labels>
        <label>
          <name>{LABEL}</name>
          <attributes>
            <attribute>
              <name>score</name>
              <mutable>False</mutable>
              <input_type>text</input_type>
              <default_value></default_value>
              <values></values>
            </attribute>
          </attributes>
        </label>
      </labels>
    </task>
  </meta>
"
    );
    for (id, image) in images.iter().enumerate() {
        let (name, width, height) = (escaped(&image.file_name), image.width, image.height);
        let _ = writeln!(
            text,
            r#"  <image id="{id}" name="{name}" width="{width}" height="{height}">"#
        );
        for (clipped, person) in image.boxes() {
            let (corners, rotation) = match boxes {
                BoxKind::AxisParallel => (clipped, String::new()),
                BoxKind::Oriented => unturned(&person.oriented_box),
            };
            let [left, top, right, bottom] = corners;
            let score = share(person.score);
            let _ = writeln!(
                text,
                r#"    <box label="{LABEL}" source="auto" occluded="0" xtl="{left:.2}" ytl="{top:.2}" xbr="{right:.2}" ybr="{bottom:.2}" z_order="0"{rotation}>
      <attribute name="score">{score}</attribute>
    </box>"#
            );
        }
        text += "  </image>\n";
    }
    text + "</annotations>\n"
}

/// Returns the corners of the unrotated box, and the attribute of its rotation.
fn unturned(oriented: &OrientedBox) -> ([f64; 4], String) {
    let (x, y) = (oriented.center.x, oriented.center.y);
    let (half_width, half_height) = (oriented.width / 2.0, oriented.height / 2.0);
    let degrees = pixels(oriented.angle.to_degrees().rem_euclid(360.0));
    // Rounding can make a full turn of a small negative angle.
    let below_a_turn = if degrees < 360.0 { degrees } else { 0.0 };
    let [left, right] = [x - half_width, x + half_width].map(pixels);
    let [top, bottom] = [y - half_height, y + half_height].map(pixels);
    let rotation = format!(r#" rotation="{below_a_turn:.2}""#);
    ([left, top, right, bottom], rotation)
}

/// Pascal VOC: an XML file per image, in `Annotations/`, and their list. Boxes are corner-origin
/// pixels with two decimals, as current annotation tools write and read them.
pub(super) const VOC: FormatSpec = FormatSpec {
    media_type: "application/xml",
    boxes: SupportedBoxes::AxisParallel,
    layout: Layout::FilePerImage {
        path: |image_file_name| format!("Annotations/{}.xml", stem(image_file_name)),
        document: |image, _| voc_document(image),
        others: voc_others,
    },
};

/// The list of the images, as datumaro needs it.
fn voc_others(images: &[AnnotatedImage]) -> Vec<AnnotationFile> {
    let names = images.iter().map(|image| stem(&image.file_name));
    let names: String = names.flat_map(|name| [name, "\n"]).collect();
    vec![file("ImageSets/Main/default.txt", names)]
}

fn voc_document(image: &AnnotatedImage) -> String {
    let path = image.file_name.rsplit_once('/');
    let (folder, name) = path.unwrap_or(("", &image.file_name));
    let (folder, name) = (escaped(folder), escaped(name));
    let AnnotatedImage { width, height, .. } = image;
    let mut text = format!(
        "{DECLARATION}<annotation>
  <folder>{folder}</folder>
  <filename>{name}</filename>
  <size>
    <width>{width}</width>
    <height>{height}</height>
    <depth>3</depth>
  </size>
  <segmented>0</segmented>
"
    );
    for ([left, top, right, bottom], _) in image.boxes() {
        let _ = write!(
            text,
            "  <object>
    <name>{LABEL}</name>
    <pose>Unspecified</pose>
    <truncated>0</truncated>
    <difficult>0</difficult>
    <bndbox>
      <xmin>{left:.2}</xmin>
      <ymin>{top:.2}</ymin>
      <xmax>{right:.2}</xmax>
      <ymax>{bottom:.2}</ymax>
    </bndbox>
  </object>
"
        );
    }
    text + "</annotation>\n"
}

/// The first line of a document.
const DECLARATION: &str = "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n";

/// Returns escaped text in which U+FFFD replaces control characters and others that XML cannot
/// contain (XML 1.0, section 2.2), or that a parser would change.
fn escaped(text: &str) -> String {
    let is_refused = |c: char| c < ' ' || "\u{fffe}\u{ffff}".contains(c);
    let replaced = text.replace(is_refused, "\u{fffd}");
    escape(replaced).into_owned()
}
