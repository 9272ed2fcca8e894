//! A folder of native calibration files, read when asked for and again when they change.

use std::{
    collections::HashMap,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
    time::SystemTime,
};

use super::{Calibration, CalibrationError, CalibrationId, file};

/// Calibrations kept parsed; more than this many and the oldest are simply read again.
const MAX_PARSED: usize = 10_000;

/// A folder with one file per calibration, named `<id>.json`, `.yaml`, `.yml` or `.toml`.
#[derive(Debug)]
pub struct CalibrationFolder {
    path: PathBuf,
    parsed: Mutex<HashMap<CalibrationId, (FileVersion, Arc<Calibration>)>>,
}

/// What tells that a file has changed.
#[derive(Debug, Clone, PartialEq, Eq)]
struct FileVersion {
    path: PathBuf,
    modified: Option<SystemTime>,
    bytes: u64,
}

impl CalibrationFolder {
    /// Opens the folder.
    ///
    /// # Errors
    /// [`CalibrationError::Unreadable`] when it is not a readable folder.
    pub fn open(path: &Path) -> Result<Self, CalibrationError> {
        std::fs::read_dir(path).map_err(|source| CalibrationError::Unreadable {
            path: path.to_owned(),
            source,
        })?;
        Ok(Self {
            path: path.to_owned(),
            parsed: Mutex::default(),
        })
    }

    /// The calibration `id` as its file says now; `None` when there is no such file.
    ///
    /// # Errors
    /// [`CalibrationError`] when the file cannot be used.
    pub fn get(&self, id: &CalibrationId) -> Result<Option<Arc<Calibration>>, CalibrationError> {
        let Some(version) = self.version(id) else {
            return Ok(None);
        };
        // The map holds only whole entries, so a panic elsewhere cannot have broken it.
        let cached = {
            let parsed = self.parsed.lock().unwrap_or_else(PoisonError::into_inner);
            parsed.get(id).cloned()
        };
        if let Some((known, calibration)) = cached
            && known == version
        {
            return Ok(Some(calibration));
        }
        let calibration = Calibration::read(&version.path)?;
        if calibration.id() != id {
            return Err(CalibrationError::Invalid {
                path: version.path,
                field: "id",
                problem: format!(
                    "it is {:?}, but the file's name says \"{id}\": make them equal",
                    calibration.id().as_str()
                ),
            });
        }
        let calibration = Arc::new(calibration);
        let mut parsed = self.parsed.lock().unwrap_or_else(PoisonError::into_inner);
        if parsed.len() >= MAX_PARSED {
            parsed.clear();
        }
        parsed.insert(id.clone(), (version, Arc::clone(&calibration)));
        Ok(Some(calibration))
    }

    fn version(&self, id: &CalibrationId) -> Option<FileVersion> {
        file::ENDINGS.iter().find_map(|ending| {
            let path = self.path.join(format!("{id}.{ending}"));
            let metadata = std::fs::metadata(&path).ok()?;
            metadata.is_file().then(|| FileVersion {
                path,
                modified: metadata.modified().ok(),
                bytes: metadata.len(),
            })
        })
    }
}

#[cfg(test)]
mod tests;
