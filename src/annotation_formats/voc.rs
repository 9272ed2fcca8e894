//! Pascal VOC: an XML file per image, in `Annotations/`, and their list. Boxes are corner-origin
//! pixels with two decimals, as current annotation tools write and read them.

use std::fmt::Write;

use super::content::{
    AnnotatedImage, AnnotationFile, DECLARATION, FormatSpec, LABEL, Layout, SupportedBoxes,
    escaped, file, stem,
};

/// The format.
pub(super) const FORMAT: FormatSpec = FormatSpec {
    media_type: "application/xml",
    boxes: SupportedBoxes::AxisParallel,
    layout: Layout::FilePerImage {
        path: |image_file_name| format!("Annotations/{}.xml", stem(image_file_name)),
        document: |image, _| document(image),
        others,
    },
};

/// The list of the images, as datumaro needs it.
fn others(images: &[AnnotatedImage]) -> Vec<AnnotationFile> {
    let names = images.iter().map(|image| stem(&image.file_name));
    let names: String = names.flat_map(|name| [name, "\n"]).collect();
    vec![file("ImageSets/Main/default.txt", names)]
}

fn document(image: &AnnotatedImage) -> String {
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
