//! Calibrations: from a file to a checked camera, and to the formats of other libraries.

mod areas;
mod calibrated_camera;
mod error;
pub mod export;
mod file;
pub mod formats;
mod id;
pub mod native;
mod plausibility;
mod site;
mod warnings;

pub use areas::{AreaShare, Areas};
pub use calibrated_camera::{Calibration, CameraGeometry, FrameSizeMismatch};
pub use error::CalibrationError;
pub use file::{content as read_content, read_camera};
pub use formats::{CalibrationFile, FormatError};
pub use id::CalibrationId;
