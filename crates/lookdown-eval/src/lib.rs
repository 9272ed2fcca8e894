#![doc = include_str!("../README.md")]
//!
//! [`DataSet`] reads the annotations, [`detect`] runs a detector on them, [`Summary`] has the
//! figures.

mod counts;
mod data_set;
mod ground_truth;
mod matching;
mod outline;
mod precision_recall;
mod rotated_box;
mod row;
mod run;
mod saved;
mod strata;
mod summary;

pub use counts::{CalibrationError, CountFigures, Counts, DEFAULT_COUNT_THRESHOLD};
pub use data_set::{DataSet, DataSetImage, ImageId, ScoringMismatch};
pub use ground_truth::{AnnotatedPerson, EvaluatedImage, GroundTruth, ScoredBox};
pub use matching::Outcome;
pub use outline::{Outline, Scoring};
pub use precision_recall::AveragePrecision;
pub use precision_recall::{OperatingPoint, PrecisionRecallCurve};
pub use rotated_box::{Region, RotatedBox};
pub use row::{DetectedRow, EvaluatedRow, FoundPerson, RowCost, RowName};
pub use run::detect;
pub use strata::{NoStrata, Stratification, Stratum, StratumFigures};
pub use summary::{NoPersons, Summary};
