//! The store of calibration files: a trait, which tests implement, too, and the folder.

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
    /// [`StoreError`] when the store cannot be read, or has more than [`MAX_FILES`].
    fn list(&self) -> Result<Vec<ListedFile>, StoreError>;

    /// Returns the content of a file, cut after `at_most` bytes.
    ///
    /// # Errors
    /// [`StoreError`] when the file cannot be read, for example because it has gone meanwhile.
    fn read(&self, name: &str, at_most: usize) -> Result<Vec<u8>, StoreError>;

    /// Creates or replaces a file atomically: a reader, also after a crash, sees
    /// the old file or the new one.
    ///
    /// # Errors
    /// [`StoreError::Changed`] when there is something else to replace than `replaces` says, others
    /// when it cannot be written; then the old one is there.
    fn write(&self, name: &str, content: &[u8], replaces: Replaces<'_>) -> Result<(), StoreError>;

    /// Removes a file, unless it is gone already.
    ///
    /// # Errors
    /// [`StoreError`] when it cannot be removed.
    fn delete(&self, name: &str) -> Result<(), StoreError>;
}

/// The maximum number of files in a store.
pub const MAX_FILES: usize = 50_000;

/// The content that a write may replace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Replaces<'a> {
    /// Whatever there is.
    Anything,
    /// Nothing: there must be no such file yet.
    Nothing,
    /// The file with this stamp.
    Stamp(&'a str),
}

/// A file in the list of a store.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ListedFile {
    /// Its name, without the place.
    pub name: String,
    /// Changes whenever the content does.
    pub stamp: String,
}

/// A failed operation of a store.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The place is not there or does not answer.
    #[error("{place}: {problem}")]
    Failed {
        /// The store.
        place: String,
        /// The error of the operating system.
        problem: String,
    },
    /// The place may be read only.
    #[error("{place} cannot be written to: {problem}")]
    ReadOnly {
        /// The store.
        place: String,
        /// The error of the operating system.
        problem: String,
    },
    /// Another writer has changed the file meanwhile.
    #[error("{place}/{name} was changed by another writer meanwhile")]
    Changed {
        /// The store.
        place: String,
        /// The file.
        name: String,
    },
}
