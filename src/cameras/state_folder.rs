//! The files of the state folder, which only this user can read.

use std::{
    fs,
    io::{self, Write},
    os::unix::fs::{DirBuilderExt, OpenOptionsExt},
    path::{Path, PathBuf},
};

use lookdown_common::{ConfigError, Replacement, Secret, read_file};
use serde::de::DeserializeOwned;

use super::error::CameraError;

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

    /// Writes a file that only this user can read, in one step.
    pub(crate) fn write(&self, path: &Path, content: &str) -> Result<(), CameraError> {
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
