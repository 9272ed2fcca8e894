//! The loader of models that run in this process.

use std::{num::NonZeroUsize, path::PathBuf};

use super::{OnnxDetector, OnnxOptions};
use crate::inference::{Model, ModelLoader};

/// Returns the loader of models that run in `sessions` sessions of the ONNX Runtime in `library`.
pub fn onnx_loader(library: PathBuf, options: OnnxOptions, sessions: NonZeroUsize) -> ModelLoader {
    Box::new(move |path| {
        let (first, others) = OnnxDetector::load_sessions(&library, path, &options, sessions)?;
        Ok(Model::from_sessions(first, others))
    })
}
