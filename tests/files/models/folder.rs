//! Model folders for tests.

use std::{
    fs,
    num::NonZeroUsize,
    path::{Path, PathBuf},
};

use lookdown_detect::inference::{
    CandidateOptions, Device, InferenceError, Model, OnnxDetector, OnnxOptions, onnx_loader,
};
use tempfile::TempDir;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// A file of the repository.
pub(crate) fn in_repository(path: &str) -> PathBuf {
    Path::new(ROOT).join(path)
}

/// An ONNX file made for tests.
pub(crate) fn fixture(name: &str) -> PathBuf {
    in_repository("tests/fixtures/models").join(format!("{name}.onnx"))
}

/// The ONNX Runtime library installed by `make setup`.
pub(crate) fn library() -> PathBuf {
    in_repository("runtime/libonnxruntime.so")
}

/// Options for networks in tests.
pub(crate) fn options() -> OnnxOptions {
    OnnxOptions {
        device: Device::Cpu,
        threads: NonZeroUsize::new(2).unwrap(),
        views_per_run: None,
        candidates: CandidateOptions {
            score_floor: 0.01,
            max_detections_per_view: 100,
        },
    }
}

/// A model with two sessions.
pub(crate) fn model_of_two_sessions(path: &Path) -> Result<Model, InferenceError> {
    let two = NonZeroUsize::new(2).unwrap();
    onnx_loader(library(), options(), two)(path)
}

/// Writes a model folder: an ONNX file and a manifest with `name` and the fields in `more`.
pub(crate) fn write(folder: &Path, name: &str, more: &str, onnx: &Path) {
    fs::create_dir_all(folder).unwrap();
    // Copies to a temporary name first, like an operator who replaces a model.
    fs::copy(onnx, folder.join("model.onnx.new")).unwrap();
    fs::rename(folder.join("model.onnx.new"), folder.join("model.onnx")).unwrap();
    let manifest = format!("name = \"{name}\"\nonnx = \"model.onnx\"\n{more}");
    fs::write(folder.join("model.toml"), manifest).unwrap();
}

/// Loads a model made for tests with a manifest.
pub(crate) fn load(onnx: &str, more: &str) -> Result<OnnxDetector, InferenceError> {
    let folder = TempDir::new().unwrap();
    write(folder.path(), "mine", more, &fixture(onnx));
    OnnxDetector::load(&library(), folder.path(), &options())
}

/// The error message for a refused model.
#[track_caller]
pub(crate) fn refusal(onnx: &str, more: &str) -> String {
    match load(onnx, more) {
        Ok(_) => panic!("{onnx} was loaded"),
        Err(error) => error.to_string(),
    }
}
