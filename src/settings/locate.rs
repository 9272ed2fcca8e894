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

/// Folder of the files of the Debian package, which other installations may use, too.
const SYSTEM_FOLDER: &str = "/usr/lib/lookdown";

/// Returns the folders that may contain the files of this installation, best first: that of the
/// executable, the repository that it was built in, and the folder of the Debian package. The
/// current folder is not one of them: its owner would choose the code that this program runs.
fn installation_folders() -> Vec<PathBuf> {
    let executable = std::env::current_exe().unwrap_or_default();
    let mut folders: Vec<_> = executable
        .parent()
        .map(Path::to_owned)
        .into_iter()
        .collect();
    folders.extend(repository_of(&executable));
    folders.push(SYSTEM_FOLDER.into());
    folders
}

/// Returns the repository whose `target` folder contains the executable.
fn repository_of(executable: &Path) -> Option<PathBuf> {
    let mut above = executable.ancestors().skip(1);
    let target = above.find(|folder| folder.file_name().is_some_and(|name| name == "target"))?;
    let repository = target.parent()?;
    let is_repository = ["Cargo.toml", "crates/lookdown-detect/Cargo.toml"]
        .iter()
        .all(|file| repository.join(file).is_file());
    is_repository.then(|| repository.to_owned())
}

/// Returns the folder of calibrations; `None` if none is set and the default folder does not exist.
/// The default folder is searched for in the current folder first, because calibrations are data.
///
/// # Errors
/// If the given folder does not exist.
pub fn find_calibrations(folder: &Path) -> Result<Option<PathBuf>, SettingsError> {
    if folder.exists() {
        return Ok(Some(folder.to_owned()));
    }
    if folder == Path::new(DEFAULT_CALIBRATIONS) {
        return Ok(find_installed(folder));
    }
    Err(SettingsError::missing(
        "calibrations.path",
        "folder",
        folder,
        "create it, or set LOOKDOWN__CALIBRATIONS__PATH to another",
    ))
}

/// Returns the existing file or folder of the installation at a relative path.
pub fn find_installed(path: &Path) -> Option<PathBuf> {
    let mut candidates = installation_folders()
        .into_iter()
        .map(|folder| folder.join(path));
    candidates.find(|candidate| candidate.exists())
}

/// Returns true if a file is one of the installation, of [`PackagedFiles`] included.
pub fn is_installed(path: &Path) -> bool {
    let Ok(path) = path.canonicalize() else {
        return false;
    };
    let packaged = PACKAGED_FILES.get().map(|files| files.models.clone());
    let mut folders = installation_folders().into_iter().chain(packaged);
    folders.any(|folder| {
        folder
            .canonicalize()
            .is_ok_and(|folder| path.starts_with(folder))
    })
}

/// Returns the existing file or folder for `path`.
///
/// A given path is used unchanged. The default path is that of [`PackagedFiles`]. Without them it
/// is searched for in the folders of the installation only, so that no library or model of the
/// current folder is used unless a setting names it.
pub(super) fn locate(path: &Path, default: &str) -> Option<PathBuf> {
    if path != Path::new(default) {
        return path.exists().then(|| path.to_owned());
    }
    let packaged = PACKAGED_FILES.get().and_then(|files| match default {
        DEFAULT_LIBRARY => Some(files.library.clone()),
        DEFAULT_REPOSITORY => Some(files.models.clone()),
        _ => None,
    });
    packaged.or_else(|| find_installed(path))
}
