#![doc = include_str!("../README.md")]

mod areas;
mod calibrated_camera;
pub mod export;
mod file;
pub mod formats;
mod id;
pub mod native;
pub mod revision;
mod site;
pub mod warning;
mod warnings;

pub use areas::{AreaShare, Areas};
pub use calibrated_camera::{Calibration, CameraGeometry, FrameSizeMismatch};
pub use file::{content as read_content, read_camera};
pub use formats::{CalibrationFile, FormatError};
pub use id::CalibrationId;
