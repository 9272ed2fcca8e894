//! The parameters of requests: the tables of their specifications, the checks of their values, and
//! default values for them. Pure: they are known before a frame or a camera is.

#[macro_use]
mod parameter_spec;

mod checked_defaults;
mod defaults;
mod detect_parameters;
mod given_parameters;
mod parameter_error;
mod priority;
mod profile;
mod score_calibration;
mod tuning;

pub use defaults::{DefaultSource, DefaultUsed, DetectDefaults};
pub use detect_parameters::{DetectParameters, parse_profile};
pub use given_parameters::GivenParameters;
pub use parameter_error::{ParameterError, ParameterFault, whole_number};
pub use parameter_spec::{Interface, JsonType, ParameterDefault, ParameterKind, ParameterSpec};
pub use priority::Priority;
pub use profile::Profile;
pub(crate) use score_calibration::ScoreCalibration;
pub use tuning::Tuning;
