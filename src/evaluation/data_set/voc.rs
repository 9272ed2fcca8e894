//! Pascal VOC XML: one file per image, with the same name. The box annotations of PIROPO have this
//! format, too (Tamura et al., "Omnidirectional Pedestrian Detection by Rotation Invariant
//! Training", WACV 2019, the annotations named `normal`).
//!
//! `bndbox` is read as corner-origin pixels, as current annotation tools write it. The VOC
//! challenge itself counts pixels from 1. This difference of one pixel is negligible here.

use std::path::{Path, PathBuf};

use roxmltree::{Document, Node};

use super::{DataSet, DataSetError, DataSetImage, ImageId, PictureIndex, text::read_text};
use crate::{
    detection::BBox,
    evaluation::{AnnotatedPerson, Outline, Scoring},
};

/// The file of a crowded image has some 100 kB.
const MAX_BYTES: u64 = 16 * 1024 * 1024;

/// Reads one file per image. Its path below `root` is the ID of the image.
pub(super) fn read_files(
    root: &Path,
    files: &[PathBuf],
    pictures: &PictureIndex,
) -> Result<DataSet, DataSetError> {
    let mut images = Vec::with_capacity(files.len());
    let mut is_anything_annotated = false;
    for path in files {
        let wrong = |problem| DataSetError::Annotations {
            path: path.clone(),
            problem,
        };
        let text = read_text(path, MAX_BYTES)?;
        let document =
            Document::parse(&text).map_err(|error| wrong(format!("not XML: {error}")))?;
        let annotation = document.root_element();
        is_anything_annotated |= objects(annotation).next().is_some();
        let id = path.strip_prefix(root).unwrap_or(path).with_extension("");
        let id = ImageId::Text(id.to_string_lossy().into_owned());
        images.push(read(path, id, annotation, pictures).map_err(wrong)?);
    }
    let is_somebody_there = images
        .iter()
        .any(|image: &DataSetImage| !image.truth.persons.is_empty());
    match files.first() {
        Some(first) if is_anything_annotated && !is_somebody_there => {
            Err(DataSetError::Annotations {
                path: first.clone(),
                problem: "no object in any file is named person; give the persons that name"
                    .to_owned(),
            })
        }
        _ => Ok(DataSet {
            images,
            scoring: Scoring::AxisParallel,
        }),
    }
}

fn read(
    path: &Path,
    id: ImageId,
    annotation: Node<'_, '_>,
    pictures: &PictureIndex,
) -> Result<DataSetImage, String> {
    if annotation.tag_name().name() != "annotation" {
        return Err(format!(
            "not a VOC annotation: its root is <{}> instead of <annotation>",
            annotation.tag_name().name()
        ));
    }
    let picture = pictures.named_like(path)?;
    let mut image = DataSetImage::empty(id, picture);
    image.size = match child(annotation, "size") {
        Some(size) => Some([number(size, "width")?, number(size, "height")?]),
        None => None,
    };
    for object in objects(annotation).filter(is_person) {
        let bndbox = child(object, "bndbox").ok_or("an object has no bndbox; add one")?;
        let corners = [
            number(bndbox, "xmin")?,
            number(bndbox, "ymin")?,
            number(bndbox, "xmax")?,
            number(bndbox, "ymax")?,
        ];
        let bbox = BBox::new(corners).map_err(|error| format!("bndbox: {error}"))?;
        let is_difficult = child(object, "difficult").is_some_and(|node| text_of(node) == "1");
        image.add(AnnotatedPerson {
            counts: !is_difficult,
            ..AnnotatedPerson::from(Outline::AxisParallel(bbox))
        });
    }
    Ok(image)
}

fn objects<'a, 'input>(root: Node<'a, 'input>) -> impl Iterator<Item = Node<'a, 'input>> {
    root.children().filter(|node| node.has_tag_name("object"))
}

/// VOC has one class of persons, named `person`.
fn is_person(object: &Node<'_, '_>) -> bool {
    child(*object, "name").is_some_and(|name| text_of(name).eq_ignore_ascii_case("person"))
}

fn child<'a, 'input>(parent: Node<'a, 'input>, name: &str) -> Option<Node<'a, 'input>> {
    parent.children().find(|node| node.has_tag_name(name))
}

fn text_of<'a>(node: Node<'a, '_>) -> &'a str {
    node.text().unwrap_or_default().trim()
}

fn number<T: std::str::FromStr>(parent: Node<'_, '_>, name: &str) -> Result<T, String> {
    let text = child(parent, name).map(text_of).unwrap_or_default();
    text.parse().map_err(|_| {
        format!(
            "{}: {name} is {text:?}; give a number of pixels",
            parent.tag_name().name()
        )
    })
}

#[cfg(test)]
mod tests;
