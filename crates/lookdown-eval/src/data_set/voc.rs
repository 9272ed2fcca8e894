//! Pascal VOC XML: one file per image, with the same name. The box annotations of PIROPO have this
//! format, too (Tamura et al., "Omnidirectional Pedestrian Detection by Rotation Invariant
//! Training", WACV 2019, the annotations named `normal`).
//!
//! `bndbox` is read as corner-origin pixels, as current annotation tools write it. The VOC
//! challenge itself counts pixels from 1. This difference of one pixel is negligible here.

use std::path::{Path, PathBuf};

use lookdown_common::files::FileError;
use lookdown_detect::detection::BBox;
use quick_xml::{Reader, events::Event};
use serde::Deserialize;

use super::{DataSet, DataSetImage, ImageFileIndex, ImageId, image_files::read_text};
use crate::{AnnotatedPerson, Outline, Scoring};

/// The file of a crowded image has some 100 kB.
const MAX_BYTES: u64 = 16 * 1024 * 1024;

/// The root element of an annotation file.
const ROOT: &str = "annotation";

/// The part of an annotation file that is read. Numbers are texts, so that errors can name them.
#[derive(Deserialize)]
struct Annotation {
    size: Option<Size>,
    #[serde(rename = "object", default)]
    objects: Vec<Object>,
}

#[derive(Deserialize)]
struct Size {
    #[serde(default)]
    width: String,
    #[serde(default)]
    height: String,
}

#[derive(Deserialize)]
struct Object {
    #[serde(default)]
    name: String,
    #[serde(default)]
    difficult: String,
    bndbox: Option<Bndbox>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Bndbox {
    xmin: String,
    ymin: String,
    xmax: String,
    ymax: String,
}

/// Reads one file per image. Its path below `root` is the ID of the image.
pub(super) fn read_files(
    root: &Path,
    files: &[PathBuf],
    image_files: &ImageFileIndex,
) -> Result<DataSet, FileError> {
    let mut images = Vec::with_capacity(files.len());
    let mut is_anything_annotated = false;
    for path in files {
        let wrong = |problem: String| FileError::new(path, problem);
        let text = read_text(path, MAX_BYTES)?;
        check_root(&text).map_err(wrong)?;
        let annotation: Annotation = quick_xml::de::from_str(&text)
            .map_err(|error| wrong(format!("not a VOC annotation: {error}")))?;
        is_anything_annotated |= !annotation.objects.is_empty();
        let id = path.strip_prefix(root).unwrap_or(path).with_extension("");
        let id = ImageId::Text(id.to_string_lossy().into_owned());
        images.push(read(path, id, &annotation, image_files).map_err(wrong)?);
    }
    let has_persons = images
        .iter()
        .any(|image: &DataSetImage| !image.truth.persons.is_empty());
    match files.first() {
        Some(first) if is_anything_annotated && !has_persons => Err(FileError::new(
            first,
            "no object in any file is named person; give the persons that name",
        )),
        _ => Ok(DataSet {
            images,
            scoring: Scoring::AxisParallel,
        }),
    }
}

/// Refuses a document that is not XML, or that has another root element.
fn check_root(text: &str) -> Result<(), String> {
    let mut reader = Reader::from_str(text);
    loop {
        let event = reader
            .read_event()
            .map_err(|error| format!("not a VOC annotation: {error}"))?;
        match event {
            Event::Start(start) | Event::Empty(start) => {
                let root = String::from_utf8_lossy(start.name().into_inner()).into_owned();
                return if root == ROOT {
                    Ok(())
                } else {
                    Err(format!(
                        "not a VOC annotation: its root is <{root}> instead of <{ROOT}>"
                    ))
                };
            }
            Event::Eof => return Err("not a VOC annotation: it has no element".to_owned()),
            _ => {}
        }
    }
}

fn read(
    path: &Path,
    id: ImageId,
    annotation: &Annotation,
    image_files: &ImageFileIndex,
) -> Result<DataSetImage, String> {
    let image_file = image_files.named_like(path)?;
    let mut image = DataSetImage::empty(id, image_file);
    image.size = match &annotation.size {
        Some(Size { width, height }) => Some([
            number("size: width", width)?,
            number("size: height", height)?,
        ]),
        None => None,
    };
    for object in annotation
        .objects
        .iter()
        .filter(|object| object.is_person())
    {
        let bndbox = object
            .bndbox
            .as_ref()
            .ok_or("an object has no bndbox; add one")?;
        let corners = [
            number("bndbox: xmin", &bndbox.xmin)?,
            number("bndbox: ymin", &bndbox.ymin)?,
            number("bndbox: xmax", &bndbox.xmax)?,
            number("bndbox: ymax", &bndbox.ymax)?,
        ];
        let bbox = BBox::new(corners).map_err(|error| format!("bndbox: {error}"))?;
        image.add(AnnotatedPerson {
            counts: object.difficult.trim() != "1",
            ..AnnotatedPerson::from(Outline::AxisParallel(bbox))
        });
    }
    Ok(image)
}

impl Object {
    /// VOC has one class of persons, named `person`.
    fn is_person(&self) -> bool {
        self.name.trim().eq_ignore_ascii_case("person")
    }
}

fn number<T: std::str::FromStr>(name: &str, text: &str) -> Result<T, String> {
    let text = text.trim();
    text.parse()
        .map_err(|_| format!("{name} is {text:?}; give a number of pixels"))
}

#[cfg(test)]
mod tests;
