//! CVAT for images 1.1: one XML document. An oriented box is written unrotated, with its clockwise
//! `rotation` about its center in degrees, from 0 to below 360.

use std::fmt::Write;

use lookdown_lens::geometry::OrientedBox;

use super::content::{
    AnnotatedImage, BoxKind, DECLARATION, FormatSpec, LABEL, Layout, SupportedBoxes, escaped,
};
use crate::rounding::{pixels, share};

/// The format.
pub(super) const FORMAT: FormatSpec = FormatSpec {
    media_type: "application/xml",
    boxes: SupportedBoxes::Both,
    layout: Layout::OneFile {
        path: "annotations.xml",
        document,
    },
};

fn document(images: &[AnnotatedImage], boxes: BoxKind) -> String {
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
