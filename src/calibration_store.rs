//! Stores of calibrations, and the calibrations that a server has read from them.

mod calibrations;
mod store;

pub use calibrations::{
    CalibrationEntry, CalibrationRow, Calibrations, CalibrationsHealth, ChangeError, Put, Reading,
    WriteCondition, defaults,
};
pub use store::{
    BucketStore, CalibrationStore, FolderStore, ListedFile, MAX_FILES, READ_AT_ONCE, Replaces,
    StoreError,
};
