//! Calibrations: from a file to a checked camera.

mod calibrated_camera;
mod doubts;
mod error;
pub mod export;
mod file;
mod folder;
pub mod formats;
mod id;
mod lens_fields;
pub mod native;
mod plausibility;

pub use calibrated_camera::{Calibration, CameraGeometry, FrameSizeMismatch};
pub use error::CalibrationError;
pub use file::content as read_content;
pub use folder::CalibrationFolder;
pub use formats::{CalibrationFile, FormatError};
pub use id::CalibrationId;
pub use lens_fields::LensFieldsError;
