//! The parameters of requests: the tables of their specifications, the checks of their values, and
//! default values for them. Pure: they are known before a frame or a camera is.

#[macro_use]
mod parameter_spec;

mod detect_parameters;
mod given_parameters;
mod priority;
mod profile;
mod score_calibration;

pub use detect_parameters::{DetectParameters, parse_profile};
pub use given_parameters::GivenParameters;
pub use given_parameters::{DefaultSource, DefaultUsed, DetectDefaults};
pub use parameter_spec::{Interface, JsonType, ParameterDefault, ParameterKind, ParameterSpec};
pub use parameter_spec::{ParameterError, ParameterFault, whole_number};
pub use priority::Priority;
pub use profile::Profile;
pub use profile::Tuning;
pub(crate) use score_calibration::ScoreCalibration;
