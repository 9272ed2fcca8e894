//! A folder of calibration files, read when asked for and again when they change.

use std::{
    collections::HashMap,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
    time::SystemTime,
};

use super::{Calibration, CalibrationError, CalibrationId, FormatError, file};

/// Calibrations kept parsed; more than this many and the oldest are simply read again.
const MAX_PARSED: usize = 10_000;

/// A folder of calibration files in any format, named `<id>.json`, `.yaml`, `.yml`, `.toml`, `.xml` or
/// `.txt`; the cameras of a file that holds several have its name and their own, `lobby-cam0`.
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
        if let Some(version) = self.version(id.as_str()) {
            return self.cached(id, version, only_camera).map(Some);
        }
        // One of several cameras in a file: `lobby.yaml` holds `lobby-cam0`. A file that does not
        // hold it says nothing about it, whatever else is wrong there.
        let stems = id.as_str().match_indices('-').map(|(at, _)| at);
        for version in stems.filter_map(|at| self.version(&id.as_str()[..at])) {
            match self.cached(id, version, one_of_several) {
                Err(CalibrationError::NotInFile { .. }) => {}
                found => return found.map(Some),
            }
        }
        Ok(None)
    }

    /// The calibration `id` from the file at `version`, read with `read` unless it is known.
    fn cached(
        &self,
        id: &CalibrationId,
        version: FileVersion,
        read: impl Fn(&CalibrationId, &Path) -> Result<Calibration, CalibrationError>,
    ) -> Result<Arc<Calibration>, CalibrationError> {
        // The map holds only whole entries, so a panic elsewhere cannot have broken it.
        let cached = {
            let parsed = self.parsed.lock().unwrap_or_else(PoisonError::into_inner);
            parsed.get(id).cloned()
        };
        if let Some((known, calibration)) = cached
            && known == version
        {
            return Ok(calibration);
        }
        let calibration = Arc::new(read(id, &version.path)?);
        let mut parsed = self.parsed.lock().unwrap_or_else(PoisonError::into_inner);
        if parsed.len() >= MAX_PARSED {
            parsed.clear();
        }
        parsed.insert(id.clone(), (version, Arc::clone(&calibration)));
        Ok(calibration)
    }

    fn version(&self, stem: &str) -> Option<FileVersion> {
        file::ENDINGS.iter().find_map(|ending| {
            let path = self.path.join(format!("{stem}.{ending}"));
            let metadata = std::fs::metadata(&path).ok()?;
            metadata.is_file().then(|| FileVersion {
                path,
                modified: metadata.modified().ok(),
                bytes: metadata.len(),
            })
        })
    }
}

/// The camera of a file that has its name.
fn only_camera(id: &CalibrationId, path: &Path) -> Result<Calibration, CalibrationError> {
    let calibration = Calibration::read(path)?;
    if calibration.id() == id {
        return Ok(calibration);
    }
    let problem = format!(
        "it is {:?}, but the file's name says \"{id}\": make them equal",
        calibration.id().as_str()
    );
    Err(CalibrationError::in_file(
        path,
        FormatError::invalid("id", problem),
    ))
}

/// The camera of that ID among those of a file.
fn one_of_several(id: &CalibrationId, path: &Path) -> Result<Calibration, CalibrationError> {
    let not_in_file = || CalibrationError::NotInFile {
        path: path.to_owned(),
        id: id.clone(),
    };
    let cameras = file::read_all(path).map_err(|_| not_in_file())?;
    let camera = cameras.into_iter().find(|(known, _)| known == id.as_str());
    let (_, calibration) = camera.ok_or_else(not_in_file)?;
    calibration.map_err(|problem| CalibrationError::in_file(path, problem))
}

#[cfg(test)]
mod tests;
