//! Exports detected persons in the file formats of annotation tools, for correction there: COCO,
//! CVAT, YOLO, Pascal VOC, and GeoJSON. The output is text in memory, which the caller writes or
//! sends.

mod coco;
mod content;
mod cvat;
mod geojson;
mod report;
mod voc;
mod xml;
mod yolo;

use strum::{Display, EnumString, VariantArray};

pub use self::content::{AnnotatedBox, AnnotatedImage, AnnotationFile, BoxKind};
use self::content::{LABEL, file, per_image, stem};

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

#[cfg(test)]
mod tests;
