//! Reasons for which a calibration cannot be used or was not changed, or for which the outcome is
//! unknown.

use lookdown_calibration::{CalibrationId, FormatError};

use crate::calibration_store::StoreError;

/// A calibration that was not changed, or that could not be read back afterwards. Every message is
/// one sentence with the remedy.
#[derive(Debug, thiserror::Error)]
pub enum ChangeError {
    /// The operator has switched changes off.
    #[error(
        "calibrations are not changed through this server (calibrations.writable is false): change \
         them where they are stored"
    )]
    NotWritable,
    /// There is no such calibration.
    #[error("there is no calibration \"{id}\": GET /calibrations lists those there are")]
    Unknown {
        /// The ID.
        id: CalibrationId,
    },
    /// The calibration belongs to a sample frame and is part of the program.
    #[error(
        "calibration \"{id}\" is built in and cannot be deleted: leave it, or store another one under this ID"
    )]
    Sample {
        /// The ID.
        id: CalibrationId,
    },
    /// The content makes no calibration.
    #[error(transparent)]
    Content(#[from] FormatError),
    /// The content holds several cameras and none was chosen.
    #[error(
        "the file holds {} cameras: choose one with ?camera=NAME: {}", names.len(), names.join(", ")
    )]
    SeveralCameras {
        /// Their names.
        names: Vec<String>,
    },
    /// The content does not hold the camera that was chosen.
    #[error("camera: the file holds {}, not {camera:?}", names.join(", "))]
    UnknownCamera {
        /// The name asked for.
        camera: String,
        /// The names there are.
        names: Vec<String>,
    },
    /// The calibration is not at the revision that the change was made for.
    #[error(
        "the calibration is {now}, which the condition of the request does not allow: get it, look \
         at what has changed, and send your change again"
    )]
    Outdated {
        /// The description of the problem.
        now: String,
    },
    /// The calibration shares its file with others.
    #[error("{file} holds several cameras ({}): change that file itself", ids.join(", "))]
    Shared {
        /// The name of the file.
        file: String,
        /// The IDs of the cameras.
        ids: Vec<String>,
    },
    /// The change was made, but could not be read back.
    #[error("the calibration was changed, but {0}")]
    Unseen(StoreError),
    /// The store did not do it.
    #[error(transparent)]
    Store(StoreError),
}

impl From<StoreError> for ChangeError {
    fn from(error: StoreError) -> Self {
        match error {
            StoreError::Changed { .. } => Self::Outdated {
                now: "being changed by another writer".to_owned(),
            },
            error => Self::Store(error),
        }
    }
}
