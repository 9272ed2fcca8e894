//! The persons of images, and the files that describe them.

use lookdown_detect::detection::{BBox, FramePixels};
use lookdown_lens::geometry::{OrientedBox, floor::FloorPosition};
use serde::Serialize;

use crate::rounding::pixels;

/// The class of every box.
pub(super) const LABEL: &str = "person";

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

/// The members of an image in JSON documents.
#[derive(Serialize)]
pub(super) struct ImageMembers<'a> {
    file_name: &'a str,
    width: u32,
    height: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    calibration: Option<&'a str>,
}

impl AnnotatedImage {
    /// Returns the members of the image in JSON documents.
    pub(super) fn members(&self) -> ImageMembers<'_> {
        ImageMembers {
            file_name: &self.file_name,
            width: self.width,
            height: self.height,
            calibration: self.calibration.as_deref(),
        }
    }

    /// The axis-parallel boxes, `[left, top, right, bottom]`, clipped to the image. Those outside
    /// it are left out.
    pub(super) fn boxes(&self) -> impl Iterator<Item = ([f64; 4], &AnnotatedBox)> {
        let image_box = BBox::new([0.0, 0.0, self.width.into(), self.height.into()]).ok();
        self.persons.iter().filter_map(move |person| {
            let inside = person.bbox.clipped_to(image_box.as_ref()?)?;
            Some((inside.corners().map(pixels), person))
        })
    }
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

pub(super) fn file(path: &str, content: String) -> AnnotationFile {
    AnnotationFile {
        path: path.to_owned(),
        content,
    }
}

/// The name without its last extension.
pub(super) fn stem(file_name: &str) -> &str {
    match file_name.rsplit_once('.') {
        Some((stem, ending)) if !stem.is_empty() && !ending.contains('/') => stem,
        _ => file_name,
    }
}
