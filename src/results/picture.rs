//! A picture that is kept of a camera, and of which cameras there may be some.

use std::collections::BTreeSet;

use bytes::Bytes;

use super::ReportId;

/// A picture that is to be kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NewPicture {
    /// The frame of a report.
    pub frame: Bytes,
    /// What can be drawn into it.
    pub sketch: Bytes,
}

impl NewPicture {
    /// How much memory it takes, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.frame.len() + self.sketch.len()
    }
}

/// A picture that is kept: the one of its camera's latest report.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredPicture {
    /// Its report's.
    pub id: ReportId,
    /// What is kept.
    pub picture: NewPicture,
}

/// The cameras whose pictures are kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PicturesOf {
    /// Every camera.
    All,
    /// These, perhaps none.
    Some(BTreeSet<String>),
}

impl PicturesOf {
    /// Whether this camera is one of them.
    #[must_use]
    pub fn include(&self, camera: &str) -> bool {
        match self {
            Self::All => true,
            Self::Some(cameras) => cameras.contains(camera),
        }
    }
}

impl Default for PicturesOf {
    /// Nobody's: they show people.
    fn default() -> Self {
        Self::Some(BTreeSet::new())
    }
}
