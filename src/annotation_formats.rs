//! Exports detected persons in the file formats of annotation tools, for correction there. The
//! output is text in memory, which the caller writes or sends. A new format needs a
//! `FormatSpec` and a row of the table here.

mod content;
mod json;
mod xml;
mod yolo;

use strum::{Display, EnumString, VariantArray};

pub use self::content::{AnnotatedBox, AnnotatedImage, AnnotationFile, BoxKind};
use self::content::{FormatSpec, Layout, SupportedBoxes, file};

/// Declares [`AnnotationFormat`]: for each format a description, a variant and its specification.
macro_rules! annotation_formats {
    ($($(#[doc = $description:literal])+ $variant:ident = $format:path,)+) => {
        /// A file format of annotation tools.
        #[derive(
            Debug, Clone, Copy, PartialEq, Eq, Display, EnumString, VariantArray, strum::VariantNames,
        )]
        #[strum(serialize_all = "lowercase")]
        pub enum AnnotationFormat {
            $($(#[doc = $description])+ $variant,)+
        }

        impl AnnotationFormat {
            /// Returns the name of the tools or the standard, and the files.
            pub fn description(self) -> &'static str {
                match self {
                    $(Self::$variant => concat!($($description),+).trim_ascii(),)+
                }
            }

            const fn spec(self) -> &'static FormatSpec {
                match self {
                    $(Self::$variant => &$format,)+
                }
            }
        }
    };
}

annotation_formats! {
    /// COCO detection: annotations.json.
    Coco = json::COCO,
    /// CVAT for images 1.1: annotations.xml.
    Cvat = xml::CVAT,
    /// YOLO as Ultralytics reads it, also with oriented boxes (OBB): labels/, data.yaml,
    /// classes.txt.
    Yolo = yolo::YOLO,
    /// Pascal VOC: Annotations/, ImageSets/.
    Voc = xml::VOC,
    /// GeoJSON with the oriented boxes as polygons in pixels: features/.
    GeoJson = json::GEO_JSON,
    /// CEPDOF and RAPiD, COCO with oriented boxes: annotations.json.
    Cepdof = json::CEPDOF,
    /// Label Studio: tasks.json, tasks with predictions.
    LabelStudio = json::LABEL_STUDIO,
}

impl AnnotationFormat {
    /// Returns true if the format can have oriented boxes as its shapes.
    pub fn has_oriented_boxes(self) -> bool {
        self.spec().boxes != SupportedBoxes::AxisParallel
    }

    /// Returns the formats that can have oriented boxes, for messages.
    pub fn names_with_oriented_boxes() -> String {
        let formats = Self::VARIANTS.iter();
        let formats = formats.filter(|format| format.has_oriented_boxes());
        formats.map(Self::to_string).collect::<Vec<_>>().join(", ")
    }

    /// Returns the media type of a document.
    pub const fn media_type(self) -> &'static str {
        self.spec().media_type
    }

    /// Returns the files that describe `images`. `boxes` applies only if the format has both kinds.
    /// Images whose names differ only in their extensions share a
    /// file in YOLO and VOC: the last one is written.
    pub fn files(self, images: &[AnnotatedImage], boxes: BoxKind) -> Vec<AnnotationFile> {
        match self.spec().layout {
            Layout::OneFile { path, document } => vec![file(path, document(images, boxes))],
            Layout::FilePerImage {
                path,
                document,
                others,
            } => {
                let own = images
                    .iter()
                    .map(|image| file(&path(&image.file_name), document(image, boxes)));
                others(images).into_iter().chain(own).collect()
            }
        }
    }

    /// Returns the document of one image: its own file, or that of a folder with this image only.
    pub fn document(self, image: &AnnotatedImage, boxes: BoxKind) -> String {
        match self.spec().layout {
            Layout::OneFile { document, .. } => document(std::slice::from_ref(image), boxes),
            Layout::FilePerImage { document, .. } => document(image, boxes),
        }
    }

    /// The path of the image's own file, if the format has one.
    pub fn own_file(self, image_file_name: &str) -> Option<String> {
        match self.spec().layout {
            Layout::OneFile { .. } => None,
            Layout::FilePerImage { path, .. } => Some(path(image_file_name)),
        }
    }
}

#[cfg(test)]
mod tests;
