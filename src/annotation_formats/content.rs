//! The persons of images, the files that describe them, and the specification of a format.

use lookdown_detect::{
    detection::{BBox, FramePixels},
    pipeline::{DetectionReport, Person},
};
use lookdown_lens::geometry::{OrientedBox, floor::FloorPosition};
use serde_json::{Value, json};

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

impl AnnotatedImage {
    /// Returns the persons of a report as annotations of the image with this file name.
    pub fn new(report: &DetectionReport, file_name: String) -> Self {
        let calibration = &report.calibration;
        let is_assumed = calibration.assumed_circle.is_some();
        Self {
            file_name,
            width: report.image_width,
            height: report.image_height,
            calibration: (!is_assumed).then(|| calibration.id.clone()),
            persons: report.persons.iter().map(AnnotatedBox::from).collect(),
        }
    }

    /// Returns the members of the image in JSON documents.
    pub(super) fn members(&self) -> Value {
        let (width, height) = (self.width, self.height);
        let mut members = json!({"file_name": self.file_name, "width": width, "height": height});
        if let Some(calibration) = &self.calibration {
            members["calibration"] = json!(calibration);
        }
        members
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

impl From<&Person> for AnnotatedBox {
    fn from(person: &Person) -> Self {
        Self {
            bbox: person.bbox,
            oriented_box: person.oriented_box,
            score: person.score,
            floor: person.floor,
        }
    }
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

/// A format of annotations.
pub(super) struct FormatSpec {
    /// The media type of a document. One that is not registered begins with `x.`, so that it is not
    /// taken for a report.
    pub(super) media_type: &'static str,
    pub(super) boxes: SupportedBoxes,
    pub(super) layout: Layout,
}

/// The kinds of boxes that a format can have as its shapes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SupportedBoxes {
    /// Axis-parallel boxes. Oriented boxes may be additional keys.
    AxisParallel,
    /// Oriented boxes.
    Oriented,
    /// Either kind, as requested.
    Both,
}

/// The files of a format.
pub(super) enum Layout {
    /// One file that describes all images.
    OneFile {
        path: &'static str,
        document: fn(&[AnnotatedImage], BoxKind) -> String,
    },
    /// A file for each image, and files that do not depend on the images.
    FilePerImage {
        /// Returns the path of the file of the image with this name.
        path: fn(&str) -> String,
        document: fn(&AnnotatedImage, BoxKind) -> String,
        others: fn(&[AnnotatedImage]) -> Vec<AnnotationFile>,
    },
}
