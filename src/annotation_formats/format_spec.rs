//! The specification of an annotation format.

use super::{AnnotatedImage, AnnotationFile, BoxKind};

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
        others: fn() -> Vec<AnnotationFile>,
    },
}
