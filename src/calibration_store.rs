//! Stores of calibrations, and the calibrations that a server has read from them.

mod calibrations;
mod store;

pub use calibrations::{
    CalibrationEntry, CalibrationRow, Calibrations, CalibrationsHealth, ChangeError, Put, Reading,
    WriteCondition, defaults,
};
pub use store::{CalibrationStore, FolderStore, ListedFile, MAX_FILES, Replaces, StoreError};
