//! The files of the state folder, which only this user can read: the stored cameras, their
//! passwords, and the reasons why one cannot be stored, removed or read.

use std::{
    collections::BTreeMap,
    fs,
    io::{self, Write},
    os::unix::fs::{DirBuilderExt, OpenOptionsExt},
    path::{Path, PathBuf},
};

use lookdown_common::{
    ConfigError, Replacement, Secret, StoredFile, files::MAX_SETTINGS_BYTES, plain_name, read_file,
};
use lookdown_watch::{CameraEntry, Location, SourceError};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use serde_json::{Map, Value};

/// The folder of the passwords in the state folder.
const PASSWORDS: &str = "passwords";
/// The file that is locked during a change.
const LOCK: &str = "lock";

/// The state folder, which may be missing.
#[derive(Debug)]
pub(crate) struct StateFolder(PathBuf);

impl StateFolder {
    pub(crate) fn new(path: PathBuf) -> Self {
        Self(path)
    }

    /// Returns the path of a file.
    pub(crate) fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// Returns the path of the file with the password of a camera.
    pub(crate) fn password(&self, camera: &str) -> PathBuf {
        self.0.join(PASSWORDS).join(camera)
    }

    /// Reads a JSON file. A missing file is empty.
    pub(crate) fn read<T: Default + DeserializeOwned>(&self, name: &str) -> Result<T, ConfigError> {
        let path = self.file(name);
        if !path.exists() {
            return Ok(T::default());
        }
        let content = read_file("state.path", &path)?;
        serde_json::from_slice(&content).map_err(|error| self.malformed(name, &error))
    }

    /// Reads the password of a camera as it was given. Without a file, it is empty.
    pub(crate) fn read_password(&self, camera: &str) -> Result<Secret, ConfigError> {
        let path = self.password(camera);
        if !path.exists() {
            return Ok(Secret::default());
        }
        let content = read_file("password", &path)?;
        let password = String::from_utf8_lossy(&content);
        Ok(password.strip_suffix('\n').unwrap_or(&password).into())
    }

    /// Returns the error of a file with another content.
    pub(crate) fn malformed(&self, name: &str, error: &serde_json::Error) -> ConfigError {
        let line = error.line();
        self.refused(
            name,
            &format!("is damaged at line {line}: restore it, or delete it"),
        )
    }

    /// Returns the error of a file with this problem, the end of a sentence.
    pub(crate) fn refused(&self, name: &str, problem: &str) -> ConfigError {
        let problem = format!("{} {problem}", self.file(name).display());
        ConfigError::problem("state.path", &problem)
    }

    /// Locks the folder for a change, against other processes. The lock ends with the file.
    pub(crate) fn lock(&self) -> Result<fs::File, CameraError> {
        let path = self.file(LOCK);
        let unwritable = |error| CameraError::Folder(path.clone(), error);
        create(&self.0).map_err(unwritable)?;
        let mut options = fs::OpenOptions::new();
        options.append(true).create(true).mode(0o600);
        let file = options.open(&path).map_err(unwritable)?;
        file.lock().map_err(unwritable)?;
        Ok(file)
    }

    /// Locks the folder while it is read, unless it is missing or cannot be written.
    pub(super) fn lock_to_read(&self) -> Option<fs::File> {
        self.0.exists().then(|| self.lock().ok()).flatten()
    }

    /// Writes a file that only this user can read, in one step.
    pub(crate) fn write(&self, path: &Path, content: &str) -> Result<(), CameraError> {
        if content.len() as u64 >= MAX_SETTINGS_BYTES {
            let problem = format!(
                "{} would be too large to be read again: delete entries, or shorten them",
                path.display()
            );
            return Err(ConfigError::problem("state.path", &problem).into());
        }
        let unwritable = |error| CameraError::Folder(path.to_owned(), error);
        create(path.parent().unwrap_or(&self.0)).map_err(unwritable)?;
        Replacement::for_secret(path).fill(unwritable, |file| {
            writeln!(file, "{content}").map_err(unwritable)
        })
    }

    /// Removes a file, if it exists.
    pub(crate) fn remove(path: &Path) -> Result<(), CameraError> {
        unless_missing(path, fs::remove_file(path))
    }

    /// Renames a file, if it exists.
    pub(crate) fn rename(from: &Path, to: &Path) -> Result<(), CameraError> {
        unless_missing(from, fs::rename(from, to))
    }
}

/// Creates a folder that only this user can read, if it is missing.
fn create(folder: &Path) -> io::Result<()> {
    let mut builder = fs::DirBuilder::new();
    builder.recursive(true).mode(0o700).create(folder)
}

fn unless_missing(path: &Path, done: io::Result<()>) -> Result<(), CameraError> {
    match done {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(CameraError::Folder(path.to_owned(), error))
        }
        _ => Ok(()),
    }
}

/// A camera that cannot be stored or removed.
#[derive(Debug, thiserror::Error)]
pub enum CameraError {
    /// A value that cannot be used.
    #[error(transparent)]
    Invalid(#[from] ConfigError),
    /// A camera of the settings file.
    #[error("{0}: this camera is in the settings file: change it there")]
    Configured(String),
    /// The state folder cannot be used.
    #[error("state.path: {0} cannot be written: {1}")]
    Folder(PathBuf, #[source] io::Error),
    /// Other cameras are being tested.
    #[error("other cameras are being tested: retry")]
    Busy,
    /// The camera gives no frame.
    #[error(transparent)]
    Source(#[from] SourceError),
}

/// The name in the path of a test, which no camera has.
pub(super) const TEST: &str = "test";
/// The file of the cameras in the state folder.
pub(super) const FILE: &str = "cameras.json";

/// A camera as it is stored, without its password.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StoredCamera {
    /// The URL of the source.
    pub url: String,
    /// The user name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub user: Option<String>,
    /// The interval between two frames.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub every: Option<String>,
    /// The ID of the calibration.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration: Option<String>,
    /// The profile.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profile: Option<String>,
    /// True if no frames are read.
    #[serde(default)]
    pub paused: bool,
    /// True if the latest image is kept.
    #[serde(default)]
    pub keep_image: bool,
}

impl StoredCamera {
    /// Returns the source without its query, which may hold a token.
    pub fn shown_source(&self) -> String {
        let location = Location::parse(&self.url);
        location.map_or_else(|_| String::new(), |(location, _)| location.to_string())
    }
}

/// Stored cameras by name.
pub type Stored = BTreeMap<String, StoredCamera>;

/// The content of the file of the cameras.
#[derive(Serialize)]
pub(super) struct CameraFile {
    version: u8,
    #[serde(flatten)]
    pub(super) cameras: Stored,
    /// Entries that are not cameras. They stay until they are replaced or deleted.
    #[serde(flatten)]
    pub(super) invalid: Map<String, Value>,
}

impl CameraFile {
    /// Reads the file in a state folder.
    pub(super) fn read(folder: &StateFolder) -> Result<Self, ConfigError> {
        let mut entries: Map<String, Value> = folder.read(FILE)?;
        if let Some(version) = entries.remove(StoredFile::KEY) {
            let checked = StoredFile::Cameras.check(&version.to_string());
            checked.map_err(|problem| folder.refused(FILE, &problem))?;
        }
        let (mut cameras, mut invalid) = (Stored::new(), Map::new());
        for (name, entry) in entries {
            match StoredCamera::deserialize(&entry) {
                Ok(camera) => drop(cameras.insert(name, camera)),
                Err(_) => drop(invalid.insert(name, entry)),
            }
        }
        Ok(Self {
            version: StoredFile::Cameras.version(),
            cameras,
            invalid,
        })
    }
}

/// Checks the name of a camera that is to be stored.
pub(super) fn check_name(name: &str) -> Result<(), ConfigError> {
    if plain_name::is_plain(name) && ![TEST, StoredFile::KEY].contains(&name) {
        return Ok(());
    }
    let remedy = "is not a name of 1 to 64 of a-z, 0-9, '_' and '-', and not test or version";
    Err(ConfigError::value("name", name, remedy))
}

/// Returns the entry of a stored camera, without its password.
pub(super) fn entry(name: &str, camera: &StoredCamera) -> CameraEntry {
    CameraEntry {
        name: Some(name.to_owned()),
        url: Some(camera.url.clone()),
        user: camera.user.clone(),
        every: camera.every.clone(),
        calibration: camera.calibration.clone(),
        profile: camera.profile.clone(),
        ..CameraEntry::default()
    }
}
