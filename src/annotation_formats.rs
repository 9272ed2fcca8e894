//! Exports detected persons in the file formats of annotation tools, for correction there: COCO,
//! CVAT, YOLO, Pascal VOC, and GeoJSON. The output is text in memory, which the caller writes or
//! sends.

mod coco;
mod cvat;
mod geojson;
mod report;
mod voc;
mod xml;
mod yolo;

use strum::{Display, EnumString, VariantArray};

use crate::{
    detection::{BBox, FramePixels},
    geometry::{OrientedBox, floor::FloorPosition},
};

/// The class of every box.
const LABEL: &str = "person";

/// A file format of annotation tools.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Display, EnumString, VariantArray, strum::VariantNames,
)]
#[strum(serialize_all = "lowercase")]
pub enum AnnotationFormat {
    /// COCO detection: one JSON file.
    Coco,
    /// CVAT for images 1.1: one XML file.
    Cvat,
    /// YOLO as Ultralytics reads it: a text file per image, `data.yaml` and `classes.txt`.
    Yolo,
    /// Pascal VOC: an XML file per image.
    Voc,
    /// GeoJSON: a JSON file per image, with the oriented boxes as polygons in pixels.
    GeoJson,
}

/// One image and its persons.
#[derive(Debug, Clone, PartialEq)]
pub struct AnnotatedImage {
    /// The path of the image's file from the folder of images, with `/` between its parts.
    pub file_name: String,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// The ID of its calibration. `None` if the lens was assumed.
    pub calibration: Option<String>,
    /// The persons.
    pub persons: Vec<AnnotatedBox>,
}

/// One person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AnnotatedBox {
    /// Axis-parallel box, corner-origin pixels. It is clipped to the image.
    pub bbox: BBox<FramePixels>,
    /// The box aligned with the person.
    pub oriented_box: OrientedBox,
    /// Confidence, 0 to 1.
    pub score: f64,
    /// The person's position on the floor, if the camera's height is known.
    pub floor: Option<FloorPosition>,
}

/// The box that is written if a format supports both kinds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum BoxKind {
    /// The axis-parallel box.
    #[default]
    AxisParallel,
    /// The box aligned with the person.
    Oriented,
}

/// A file of annotations.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AnnotationFile {
    /// Its path from the folder of annotations, with `/` between its parts.
    pub path: String,
    /// Its content.
    pub content: String,
}

impl AnnotationFormat {
    /// Returns whether the format offers oriented boxes beside axis-parallel ones.
    #[must_use]
    pub fn has_oriented_boxes(self) -> bool {
        self == Self::Cvat
    }

    /// Returns the files that describe `images`. `boxes` applies only if the format [has oriented
    /// boxes](Self::has_oriented_boxes). Images whose names differ only in their extensions share a
    /// file in YOLO and VOC: the last one is written.
    #[must_use]
    pub fn files(self, images: &[AnnotatedImage], boxes: BoxKind) -> Vec<AnnotationFile> {
        match self {
            Self::Coco => vec![file("annotations.json", coco::document(images))],
            Self::Cvat => vec![file("annotations.xml", cvat::document(images, boxes))],
            Self::Yolo => yolo::files(images),
            Self::Voc => per_image(images, voc::path, voc::document),
            Self::GeoJson => per_image(images, geojson::path, geojson::document),
        }
    }

    /// Returns the document of one image: its own file, or that of a folder with this image only.
    #[must_use]
    pub fn document(self, image: &AnnotatedImage, boxes: BoxKind) -> String {
        match self {
            Self::Coco => coco::document(std::slice::from_ref(image)),
            Self::Cvat => cvat::document(std::slice::from_ref(image), boxes),
            Self::Yolo => yolo::document(image),
            Self::Voc => voc::document(image),
            Self::GeoJson => geojson::document(image),
        }
    }

    /// The path of the image's own file, if the format has one.
    #[must_use]
    pub fn own_file(self, image_file_name: &str) -> Option<String> {
        match self {
            Self::Coco | Self::Cvat => None,
            Self::Yolo => Some(yolo::path(image_file_name)),
            Self::Voc => Some(voc::path(image_file_name)),
            Self::GeoJson => Some(geojson::path(image_file_name)),
        }
    }
}

impl AnnotatedImage {
    /// The axis-parallel boxes, `[left, top, right, bottom]`, clipped to the image. Those outside
    /// it are left out.
    fn boxes(&self) -> impl Iterator<Item = ([f64; 4], &AnnotatedBox)> {
        let picture = BBox::new([0.0, 0.0, self.width.into(), self.height.into()]).ok();
        self.persons.iter().filter_map(move |person| {
            let inside = person.bbox.clipped_to(picture.as_ref()?)?;
            Some((inside.corners().map(pixels), person))
        })
    }
}

fn per_image(
    images: &[AnnotatedImage],
    path: fn(&str) -> String,
    document: fn(&AnnotatedImage) -> String,
) -> Vec<AnnotationFile> {
    let files = images.iter().map(|image| AnnotationFile {
        path: path(&image.file_name),
        content: document(image),
    });
    files.collect()
}

fn file(path: &str, content: String) -> AnnotationFile {
    AnnotationFile {
        path: path.to_owned(),
        content,
    }
}

/// The name without its last extension.
fn stem(file_name: &str) -> &str {
    match file_name.rsplit_once('.') {
        Some((stem, ending)) if !stem.is_empty() && !ending.contains('/') => stem,
        _ => file_name,
    }
}

/// Rounds to two decimals: far below the accuracy of a detector.
fn pixels(value: f64) -> f64 {
    rounded(value, 100.0)
}

/// Rounds a fraction of 1 to four decimals.
fn share(value: f64) -> f64 {
    rounded(value, 10_000.0)
}

fn rounded(value: f64, per_unit: f64) -> f64 {
    // Adding zero turns −0 into 0.
    (value * per_unit).round() / per_unit + 0.0
}

#[cfg(test)]
mod tests;
