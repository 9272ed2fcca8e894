//! Person detectors: views in, boxes with scores out.

mod detector;
mod manifest;
mod onnx;

pub use detector::{Detector, InferenceError, ViewDetection};
pub use manifest::ModelManifest;
pub use onnx::{OnnxDetector, OnnxOptions};
