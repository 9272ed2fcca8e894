//! Person detectors: boxes with scores from rendered views.

mod description;
mod detector;
mod device;
mod error;
mod guess;
mod head_output;
pub mod heads;
mod manifest;
mod model;
mod onnx;
mod onnx_file;
mod registry;
mod remote;
mod repository;
mod signature;
mod staging;
mod stamp;

pub use description::{ModelDescription, OnnxTensor};
pub use detector::Detector;
pub use device::{Device, OpenVinoDevice, UnknownDevice};
pub use error::InferenceError;
pub use guess::{GuessedHead, INPUTS, guess_head, guess_size};
pub use head_output::{HeadOutput, ViewDetection};
pub use heads::CandidateOptions;
pub use manifest::{FILE_NAME as MANIFEST, Layout, ManifestInput, ModelManifest, name_from};
pub use model::Model;
pub use onnx::{OnnxDetector, OnnxOptions, onnx_loader};
pub use registry::{ModelRegistry, RegistryFull};
pub use remote::{BearerToken, InvalidToken, RemoteDetector, RemoteOptions, RemoteServer};
pub use repository::{
    ModelFolder, ModelLoader, ModelRepository, RepositoryError, RepositoryOptions, model_names,
};
