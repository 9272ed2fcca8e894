//! How good detections are: matching with the truth, precision and recall, average precision.

mod average_precision;
mod data_set;
mod ground_truth;
mod matching;
mod precision_recall;
mod region;
mod run;
mod summary;

pub use average_precision::AveragePrecision;
pub use data_set::{DataSet, DataSetError, DataSetImage};
pub use ground_truth::{EvaluatedImage, GroundTruth, ScoredBox};
pub use matching::{MatchingRule, Outcome};
pub use precision_recall::{OperatingPoint, PrecisionRecallCurve};
pub use region::Region;
pub use run::{EvaluatedRow, EvaluationError, evaluate};
pub use summary::{NoPersons, Summary};
