//! Errors of data sets.

use std::path::PathBuf;

use lookdown_calibration::CalibrationError;

use crate::Scoring;

/// The path holds no usable data set.
#[derive(Debug, thiserror::Error)]
pub enum DataSetError {
    /// A file or folder cannot be read.
    #[error("{path}: cannot be read: {source}")]
    Unreadable {
        /// The file or folder.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The format was not recognized.
    #[error(
        "{path}: holds no data set in a known format; expected annotations.json, \
         annotations/*.json, *.json, *.xml or Ground_Truth_Annotations/groundTruth_*.csv"
    )]
    Unrecognized {
        /// The path given.
        path: PathBuf,
    },
    /// Annotations cannot be used.
    #[error("{path}: {problem}")]
    Annotations {
        /// The annotation file, or the folder of them.
        path: PathBuf,
        /// The problem.
        problem: String,
    },
    /// A calibration cannot be used.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
}

/// Ground truth of one shape cannot be scored as another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "this data set has {truth} and cannot be scored by {wanted}; only rotated boxes can be made \
     axis-parallel"
)]
pub struct ScoringMismatch {
    /// The shape of the ground truth.
    pub truth: Scoring,
    /// The requested shape.
    pub wanted: Scoring,
}

impl std::fmt::Display for Scoring {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::AxisParallel => "axis-parallel boxes",
            Self::Rotated => "rotated boxes",
            Self::HeadPoint => "head points",
        })
    }
}
