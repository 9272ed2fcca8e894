//! Person detectors: boxes with scores from rendered views.

mod description;
mod detector;
mod device;
mod error;
mod guess;
pub mod heads;
mod manifest;
mod model;
mod onnx;
mod onnx_file;
mod remote;
mod repository;
mod signature;
mod staging;

pub use description::{ModelDescription, OnnxTensor};
pub use detector::{Detector, HeadOutput, ViewDetection};
pub use device::{Device, OpenVinoDevice, UnknownDevice};
pub use error::InferenceError;
pub use guess::{GuessedHead, INPUTS, guess_head, guess_size};
pub use heads::CandidateOptions;
pub use manifest::{FILE_NAME as MANIFEST, Layout, ManifestInput, ModelManifest, name_from};
pub use model::{Model, ModelRegistry, RegistryFull};
pub use onnx::{OnnxDetector, OnnxOptions, onnx_loader};
pub use remote::{BearerToken, InvalidToken, RemoteDetector, RemoteOptions, RemoteServer};
pub use repository::{
    ModelFolder, ModelLoader, ModelRepository, RepositoryError, RepositoryOptions, model_names,
};
