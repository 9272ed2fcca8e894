//! Failed changes of calibrations as problems: the only place that decides their kind.

use super::{Problem, ProblemKind};
use crate::calibration_store::{ChangeError, StoreError};

impl From<ChangeError> for Problem {
    fn from(error: ChangeError) -> Self {
        let parameter = parameter_of(&error).map(ToOwned::to_owned);
        let kind = match error {
            ChangeError::NotWritable => ProblemKind::Forbidden,
            ChangeError::Unknown { .. } => ProblemKind::UnknownCalibration,
            ChangeError::Content(_)
            | ChangeError::SeveralCameras { .. }
            | ChangeError::UnknownCamera { .. } => ProblemKind::InvalidCalibration,
            ChangeError::Outdated { .. } => ProblemKind::PreconditionFailed,
            ChangeError::Shared { .. } | ChangeError::Sample { .. } => {
                ProblemKind::CalibrationConflict
            }
            ChangeError::Unseen(_) => {
                tracing::warn!("{error}");
                let detail = "the calibration was changed, but cannot be read now: get it \
                              before you send the change again";
                return Self::new(ProblemKind::CalibrationsUnreachable, detail);
            }
            ChangeError::Store(StoreError::ReadOnly { .. }) => {
                tracing::warn!("a calibration was not changed: {error}");
                let detail = "calibrations cannot be changed: their store is read-only";
                return Self::new(ProblemKind::Forbidden, detail);
            }
            // A full disk, for example, is not a fault of the server.
            ChangeError::Store(StoreError::Failed { .. }) => {
                tracing::error!("a calibration was not changed: {error}");
                let detail =
                    "the calibrations cannot be changed now: the server's log has the reason";
                return Self::new(ProblemKind::CalibrationsUnreachable, detail);
            }
            ChangeError::Store(_) => return Self::internal(error),
        };
        Self {
            parameter,
            ..Self::new(kind, error.to_string())
        }
    }
}

/// The parameter of the request, or the field of the calibration, at fault.
fn parameter_of(error: &ChangeError) -> Option<&str> {
    match error {
        ChangeError::Content(error) => error.parameter(),
        ChangeError::SeveralCameras { .. } | ChangeError::UnknownCamera { .. } => Some("camera"),
        _ => None,
    }
}
