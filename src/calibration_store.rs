//! Stores of calibrations, and the calibrations that a server has read from them.
//!
//! The store of calibration files: a trait, which tests implement, too, and the folder.
//!
//! A folder of calibration files. Links are followed, so that the folder may be a Kubernetes
//! `ConfigMap`, whose files change when a link is turned to another folder.

mod calibrations;
#[cfg(test)]
mod tests;

use std::{
    fmt, fs,
    io::{self, ErrorKind},
    os::unix::fs::MetadataExt,
    path::{Path, PathBuf},
    time::{Duration, SystemTime},
};

use lookdown_common::{UNFINISHED, files, replace_file, sync_folder};

pub use calibrations::{
    CalibrationEntry, CalibrationRow, Calibrations, CalibrationsHealth, ChangeError, Put, Reading,
    WriteCondition, defaults,
};

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

/// No writer takes this long for a file: an older unfinished one has no writer.
const ABANDONED_AFTER: Duration = Duration::from_mins(10);

/// A folder on this machine.
#[derive(Debug)]
pub struct FolderStore {
    path: PathBuf,
    /// The folder is made by the first write; until then it is empty.
    may_be_missing: bool,
}

impl FolderStore {
    /// The folder at `path`, which must be there when it is listed.
    pub fn new(path: &Path) -> Self {
        Self {
            path: path.to_owned(),
            may_be_missing: false,
        }
    }

    /// The folder at `path`; while there is none, it counts as empty.
    pub fn that_may_be_missing(path: &Path) -> Self {
        Self {
            may_be_missing: true,
            ..Self::new(path)
        }
    }

    fn failed(&self, error: &io::Error) -> StoreError {
        let (place, problem) = (self.place(), error.to_string());
        match error.kind() {
            ErrorKind::ReadOnlyFilesystem | ErrorKind::PermissionDenied => {
                StoreError::ReadOnly { place, problem }
            }
            _ => StoreError::Failed { place, problem },
        }
    }

    fn replace(&self, name: &str, content: &[u8]) -> io::Result<()> {
        if self.may_be_missing {
            fs::create_dir_all(&self.path)?;
        }
        self.remove_abandoned()?;
        replace_file(&self.path.join(name), content)
    }

    /// Removes what killed writers left.
    fn remove_abandoned(&self) -> io::Result<()> {
        for entry in fs::read_dir(&self.path)?.take(MAX_FILES) {
            let path = entry?.path();
            let is_unfinished = path.extension().is_some_and(|ending| ending == UNFINISHED);
            if is_unfinished && is_abandoned(&path) {
                fs::remove_file(&path)?;
            }
        }
        Ok(())
    }
}

impl CalibrationStore for FolderStore {
    fn place(&self) -> String {
        self.path.display().to_string()
    }

    fn list(&self) -> Result<Vec<ListedFile>, StoreError> {
        let entries = match fs::read_dir(&self.path) {
            Err(error) if self.may_be_missing && error.kind() == ErrorKind::NotFound => {
                return Ok(Vec::new());
            }
            entries => entries.map_err(|error| self.failed(&error))?,
        };
        let mut files = Vec::new();
        for (index, entry) in entries.enumerate() {
            if index == MAX_FILES {
                let problem = io::Error::other(format!("there are more than {MAX_FILES} files"));
                return Err(self.failed(&problem));
            }
            let entry = entry.map_err(|error| self.failed(&error))?;
            // A link to nothing, as while files are being replaced, is not a file.
            if let (Ok(name), Some(stamp)) = (entry.file_name().into_string(), stamp(&entry.path()))
            {
                files.push(ListedFile { name, stamp });
            }
        }
        Ok(files)
    }

    fn read(&self, name: &str, at_most: usize) -> Result<Vec<u8>, StoreError> {
        files::read_start(&self.path.join(name), at_most as u64)
            .map_err(|error: io::Error| self.failed(&error))
    }

    fn write(&self, name: &str, content: &[u8], replaces: Replaces<'_>) -> Result<(), StoreError> {
        // File systems have no conditional rename: a writer between the check and the rename wins.
        let now = stamp(&self.path.join(name));
        let is_as_expected = match replaces {
            Replaces::Anything => true,
            Replaces::Nothing => now.is_none(),
            Replaces::Stamp(expected) => now.as_deref() == Some(expected),
        };
        if !is_as_expected {
            let (place, name) = (self.place(), name.to_owned());
            return Err(StoreError::Changed { place, name });
        }
        self.replace(name, content)
            .map_err(|error| self.failed(&error))
    }

    fn delete(&self, name: &str) -> Result<(), StoreError> {
        let removed = match fs::remove_file(self.path.join(name)) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
            removed => removed.and_then(|()| sync_folder(&self.path)),
        };
        removed.map_err(|error| self.failed(&error))
    }
}

/// Returns the stamp of a file's content, links followed: the file's identity, length and time.
fn stamp(path: &Path) -> Option<String> {
    let metadata = fs::metadata(path).ok().filter(fs::Metadata::is_file)?;
    Some(format!(
        "{}:{}:{}:{}.{:09}",
        metadata.dev(),
        metadata.ino(),
        metadata.len(),
        metadata.mtime(),
        metadata.mtime_nsec()
    ))
}

fn is_abandoned(path: &Path) -> bool {
    let modified = path.metadata().and_then(|metadata| metadata.modified());
    let age = modified
        .ok()
        .and_then(|modified| SystemTime::now().duration_since(modified).ok());
    age.is_some_and(|age| age > ABANDONED_AFTER)
}
