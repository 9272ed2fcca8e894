//! What can be wrong with a data set.

use std::path::PathBuf;

use crate::{calibration::CalibrationError, evaluation::Scoring};

/// Something that is no data set.
#[derive(Debug, thiserror::Error)]
pub enum DataSetError {
    /// A file or folder cannot be read.
    #[error("{path}: cannot be read: {source}")]
    Unreadable {
        /// The file or folder.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// Nothing tells what is there.
    #[error(
        "{path}: holds no data set that is known; expected annotations.json, annotations/*.json, \
         *.json, *.xml or Ground_Truth_Annotations/groundTruth_*.csv"
    )]
    Unrecognised {
        /// The path given.
        path: PathBuf,
    },
    /// Annotations cannot be used.
    #[error("{path}: {problem}")]
    Annotations {
        /// The annotation file, or the folder of them.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// A calibration cannot be used.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
}

/// Truths of one shape cannot be scored as another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "this data set has {truth} and cannot be scored by {wanted}; only rotated boxes can be made \
     axis-parallel"
)]
pub struct ScoringMismatch {
    /// What the truth looks like.
    pub truth: Scoring,
    /// What it was to look like.
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
