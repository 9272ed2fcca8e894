//! Where calibration files are kept: one trait, and the stores that have it.

mod folder;

use std::fmt;

pub use folder::FolderStore;

/// A place with calibration files in one level, each by its name. Calls block.
pub trait CalibrationStore: fmt::Debug + Send + Sync {
    /// The place in words, for messages.
    fn place(&self) -> String;

    /// The files there are now, in any order; other things may be among them.
    ///
    /// # Errors
    /// [`StoreError`] when the place cannot be looked at, or has more than [`MAX_FILES`].
    fn list(&self) -> Result<Vec<StoredFile>, StoreError>;

    /// The content of a file, cut after `at_most` bytes.
    ///
    /// # Errors
    /// [`StoreError`] when it cannot be read, for example because it has gone meanwhile.
    fn read(&self, name: &str, at_most: usize) -> Result<Vec<u8>, StoreError>;

    /// Creates or replaces a file at once: whoever reads, and whatever is left after a crash, sees
    /// the old file or the new one.
    ///
    /// # Errors
    /// [`StoreError`] when it cannot be written; then the old one is there.
    fn write(&self, name: &str, content: &[u8]) -> Result<(), StoreError>;

    /// Removes a file, unless it is gone already.
    ///
    /// # Errors
    /// [`StoreError`] when it cannot be removed.
    fn delete(&self, name: &str) -> Result<(), StoreError>;
}

/// Most files looked at in one place.
pub const MAX_FILES: usize = 50_000;

/// A file in a store.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredFile {
    /// Its name, without the place.
    pub name: String,
    /// Changes whenever the content does.
    pub stamp: String,
}

/// A store that did not do what it was told.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The place is not there or does not answer.
    #[error("{place}: {problem}")]
    Failed {
        /// Where.
        place: String,
        /// What the operating system or the service said.
        problem: String,
    },
    /// The place may be read only.
    #[error("{place} cannot be written to: {problem}")]
    ReadOnly {
        /// Where.
        place: String,
        /// What the operating system or the service said.
        problem: String,
    },
}
