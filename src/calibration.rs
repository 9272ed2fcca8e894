//! Calibrations: from a file to a checked camera, and the stores of such files.

mod areas;
mod calibrated_camera;
mod calibrations;
mod error;
pub mod export;
mod file;
pub mod formats;
mod id;
pub mod native;
mod plausibility;
mod store;
mod warnings;

pub use areas::Areas;
pub use calibrated_camera::{Calibration, CameraGeometry, FrameSizeMismatch};
pub use calibrations::{
    CalibrationEntry, CalibrationRow, Calibrations, CalibrationsHealth, ChangeError, Put, Reading,
    WriteCondition,
};
pub use error::CalibrationError;
pub use file::content as read_content;
pub use formats::{CalibrationFile, FormatError};
pub use id::CalibrationId;
pub use store::{
    BucketStore, CalibrationStore, FolderStore, MAX_FILES, READ_AT_ONCE, Replaces, StoreError,
    StoredFile,
};
