//! Detection of changed files without reading them.

use std::{
    os::unix::fs::MetadataExt,
    path::{Path, PathBuf},
    time::SystemTime,
};

use super::manifest::{FILE_NAME, ModelManifest};

/// Fingerprint of files: inode, length and time of modification, with symbolic links followed.
/// `None` when a file is missing, for example while it is being replaced.
pub(super) type Stamp = Option<Vec<(u64, u64, SystemTime)>>;

/// The files that make a model.
pub(super) fn files_of(model: &Path) -> Vec<PathBuf> {
    let manifest = if model.is_dir() {
        Some(model.join(FILE_NAME))
    } else {
        None
    };
    // If the manifest is invalid, only the manifest itself can be watched.
    let onnx = ModelManifest::locate(model)
        .ok()
        .map(|manifest| manifest.onnx);
    manifest.into_iter().chain(onnx).collect()
}

/// Returns the present fingerprint of the files.
pub(super) fn stamp(files: &[PathBuf]) -> Stamp {
    if files.is_empty() {
        return None;
    }
    let stamps = files.iter().map(|file| {
        let metadata = file.metadata().ok()?;
        Some((metadata.ino(), metadata.len(), metadata.modified().ok()?))
    });
    stamps.collect()
}
