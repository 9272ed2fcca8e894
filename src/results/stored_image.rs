//! An image that is kept for a camera, and the set of cameras whose images may be kept.

use std::collections::BTreeSet;

use bytes::Bytes;

use super::ReportId;

/// An image to be kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NewImage {
    /// The frame of a report.
    pub frame: Bytes,
    /// The drawings that can be added to the frame.
    pub sketch: Bytes,
}

impl NewImage {
    /// The memory that it takes, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.frame.len() + self.sketch.len()
    }
}

/// A kept image: that of its camera's latest report.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredImage {
    /// The ID of its report.
    pub id: ReportId,
    /// The image.
    pub image: NewImage,
}

/// The cameras whose images are kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ImagesOf {
    /// Every camera.
    All,
    /// These cameras, possibly none.
    Some(BTreeSet<String>),
}

impl ImagesOf {
    /// Returns true if the image of this camera may be kept.
    #[must_use]
    pub fn include(&self, camera: &str) -> bool {
        match self {
            Self::All => true,
            Self::Some(cameras) => cameras.contains(camera),
        }
    }
}

impl Default for ImagesOf {
    /// No cameras: images show people.
    fn default() -> Self {
        Self::Some(BTreeSet::new())
    }
}
