//! Telling whether files have changed without reading them.

use std::{
    os::unix::fs::MetadataExt,
    path::{Path, PathBuf},
    time::SystemTime,
};

use crate::inference::{ModelManifest, manifest::FILE_NAME};

/// What tells a file's content from another: which file it is, how long and from when; links are
/// followed. `None` when a file is not there, as while it is being replaced.
pub(in crate::inference) type Stamp = Option<Vec<(u64, u64, SystemTime)>>;

/// The files that make a model.
pub(super) fn files_of(model: &Path) -> Vec<PathBuf> {
    let manifest = if model.is_dir() {
        Some(model.join(FILE_NAME))
    } else {
        None
    };
    // Of a broken manifest only itself can be watched.
    let onnx = ModelManifest::locate(model)
        .ok()
        .map(|manifest| manifest.onnx);
    manifest.into_iter().chain(onnx).collect()
}

/// What the files are like now.
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
