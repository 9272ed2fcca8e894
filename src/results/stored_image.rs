//! An image that is kept for a camera, and the set of cameras whose images may be kept.

use std::collections::BTreeSet;

use super::ReportId;
use crate::annotated_image::StoredFrame;

/// A kept image: that of its camera's latest report.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredImage {
    /// The ID of its report.
    pub id: ReportId,
    /// The frame of its report.
    pub frame: StoredFrame,
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
