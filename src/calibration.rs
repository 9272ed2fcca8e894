//! Calibrations: from a file to a checked camera.

mod calibrated_camera;
mod error;
mod file;
mod folder;
mod id;
mod lens_fields;
pub mod native;
mod plausibility;

pub use calibrated_camera::{Calibration, CameraGeometry, FrameSizeMismatch};
pub use error::CalibrationError;
pub use folder::CalibrationFolder;
pub use id::CalibrationId;
pub use lens_fields::LensFieldsError;
