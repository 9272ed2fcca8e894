//! Changes of calibrations that came to nothing as problems: the only place that decides their status.

use super::{Problem, ProblemKind};
use crate::calibration::{ChangeError, StoreError};

impl From<ChangeError> for Problem {
    fn from(error: ChangeError) -> Self {
        let kind = match error {
            ChangeError::NotWritable => ProblemKind::Forbidden,
            ChangeError::Unknown { .. } => ProblemKind::UnknownCalibration,
            ChangeError::Content(_)
            | ChangeError::SeveralCameras { .. }
            | ChangeError::UnknownCamera { .. } => ProblemKind::InvalidCalibration,
            ChangeError::Outdated { .. } => ProblemKind::Outdated,
            ChangeError::Shared { .. } => ProblemKind::CalibrationConflict,
            ChangeError::Unseen(_) => {
                tracing::warn!("{error}");
                let detail = "the calibration was changed, but cannot be looked at now: get it \
                              before you send the change again";
                return Self::new(ProblemKind::CalibrationsUnreachable, detail);
            }
            ChangeError::Store(StoreError::ReadOnly { .. }) => {
                tracing::warn!("a calibration was not changed: {error}");
                let detail = "calibrations cannot be changed here: their store is read only";
                return Self::new(ProblemKind::Forbidden, detail);
            }
            ChangeError::Store(StoreError::Unreachable { .. }) => {
                tracing::warn!("a calibration was not changed: {error}");
                let detail = "the place of the calibrations does not answer: try again";
                return Self::new(ProblemKind::CalibrationsUnreachable, detail);
            }
            // A full disk, for one: no fault of the server's.
            ChangeError::Store(StoreError::Failed { .. }) => {
                tracing::error!("a calibration was not changed: {error}");
                let detail = "the calibrations cannot be changed now: the server's log says why";
                return Self::new(ProblemKind::CalibrationsUnreachable, detail);
            }
            ChangeError::Store(_) => return Self::internal(error),
        };
        Self::new(kind, error.to_string())
    }
}
