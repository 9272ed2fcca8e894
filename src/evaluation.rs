//! How good detections are: matching with the truth, precision and recall, average precision.

mod average_precision;
mod data_set;
mod ground_truth;
mod matching;
mod outline;
mod precision_recall;
mod region;
mod rotated_box;
mod run;
mod strata;
mod summary;

pub use average_precision::AveragePrecision;
pub use data_set::{DataSet, DataSetError, DataSetImage, ImageId, ScoringMismatch};
pub use ground_truth::{AnnotatedPerson, EvaluatedImage, GroundTruth, ScoredBox};
pub use matching::{MatchingRule, Outcome};
pub use outline::{Outline, Scoring};
pub use precision_recall::{OperatingPoint, PrecisionRecallCurve};
pub use region::Region;
pub use rotated_box::RotatedBox;
pub use run::{EvaluatedRow, EvaluationError, evaluate};
pub use strata::{NoStrata, Stratification, Stratum, StratumFigures, UnknownStratification};
pub use summary::{NoPersons, Summary};
