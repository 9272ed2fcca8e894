//! Locates the files that settings name, and those at their default paths.

use std::{
    path::{Path, PathBuf},
    sync::OnceLock,
};

pub(super) use lookdown_detect::{
    DEFAULT_MODELS as DEFAULT_REPOSITORY, DEFAULT_ONNX_RUNTIME as DEFAULT_LIBRARY,
};

use super::SettingsError;

/// Default folder of calibration files.
pub(super) const DEFAULT_CALIBRATIONS: &str = "calibrations";

/// The files of a package whose executable is not Lookdown's own, such as the Python package.
#[derive(Debug)]
pub struct PackagedFiles {
    /// The ONNX Runtime library.
    pub library: PathBuf,
    /// The folder of models.
    pub models: PathBuf,
}

static PACKAGED_FILES: OnceLock<PackagedFiles> = OnceLock::new();

/// Uses these files in this process for settings that have their default paths. Only the first call
/// has an effect.
pub fn use_packaged_files(files: PackagedFiles) {
    // A second import of the package has the same files.
    let _ = PACKAGED_FILES.set(files);
}

/// Returns the folder of calibrations; `None` if none is set and the default folder does not exist.
///
/// # Errors
/// [`SettingsError::Missing`] when the given folder does not exist.
pub fn find_calibrations(folder: &Path) -> Result<Option<PathBuf>, SettingsError> {
    let found = locate(folder, DEFAULT_CALIBRATIONS);
    if found.is_none() && folder != Path::new(DEFAULT_CALIBRATIONS) {
        return Err(SettingsError::Missing {
            key: "calibrations.path",
            what: "folder",
            path: folder.to_owned(),
            remedy: "create it, or set LOOKDOWN__CALIBRATIONS__PATH to another".to_owned(),
        });
    }
    Ok(found)
}

/// Returns the existing file or folder at `path` in the current directory, or else beside the
/// executable or in the folders above it.
#[must_use]
pub fn find_beside_executable(path: &Path) -> Option<PathBuf> {
    if path.exists() {
        return Some(path.to_owned());
    }
    let executable = std::env::current_exe().ok()?;
    let mut candidates = executable.ancestors().skip(1).map(|above| above.join(path));
    candidates.find(|candidate| candidate.exists())
}

/// Returns the existing file or folder for `path`.
///
/// A given path is used unchanged. The default path is that of [`PackagedFiles`]. Without them it is
/// searched for in the current directory, then beside the executable and in the folders above it. So
/// `/anywhere/lookdown/target/release/lookdown` finds its files from any current directory.
pub(super) fn locate(path: &Path, default: &str) -> Option<PathBuf> {
    if path != Path::new(default) {
        return path.exists().then(|| path.to_owned());
    }
    let packaged = PACKAGED_FILES.get().and_then(|files| match default {
        DEFAULT_LIBRARY => Some(files.library.clone()),
        DEFAULT_REPOSITORY => Some(files.models.clone()),
        _ => None,
    });
    packaged.or_else(|| find_beside_executable(path))
}
