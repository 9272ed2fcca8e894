//! The detection pipeline: turns an encoded frame into a report of the persons in it.

mod camera_rig;
mod default_models;
mod engine;
mod error;
mod frame_cost;
mod frame_queue;
mod given_parameters;
mod in_flight;
mod inference_cache;
mod job;
mod merge;
mod motion_cache;
mod network;
mod outline;
mod parameter_error;
mod parameter_spec;
mod parameters;
mod pass;
mod planned_views;
mod plausibility;
mod profile;
mod report;
mod rig_cache;
mod score_calibration;
mod service_rate;
#[cfg(test)]
mod test_support;
mod ticket;
mod timeline;
mod turns;
mod worker_pool;

pub use default_models::DefaultModels;
pub use engine::{Engine, EngineOptions, Observation};
pub use error::PipelineError;
pub use given_parameters::GivenParameters;
pub use in_flight::{Stall, StalledWork};
pub use job::{DetectJob, Detected, JobImage, ViewsJob};
pub use network::BatchOptions;
pub use parameter_error::{ParameterError, ParameterFault, whole_number};
pub(crate) use parameter_spec::parameter_table;
pub use parameter_spec::{Interface, JsonType, ParameterDefault, ParameterKind, ParameterSpec};
pub use parameters::{DetectParameters, parse_profile};
pub use planned_views::{PlannedView, PlannedViews};
pub use profile::Profile;
pub use report::{
    CalibrationUsed, DetectionReport, ModelUsed, Person, StageTimings, ViewCounts, ZoneCount,
};
pub use ticket::{Priority, Ticket};
pub use timeline::{Stage, StageSpan, Timeline};
pub use worker_pool::WorkerPool;
