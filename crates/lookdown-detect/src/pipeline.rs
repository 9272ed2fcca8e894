//! The detection pipeline: turns an encoded frame into a report of the persons in it.

mod calibration_lookup;
mod camera_cache;
mod camera_rig;
mod default_models;
mod engine;
mod error;
mod follow;
mod frame_cost;
mod frame_queue;
mod in_flight;
mod job;
mod merge;
mod mosaic;
mod motion_cache;
mod network;
mod outline;
mod pass;
mod planned_views;
mod plausibility;
mod report;
mod rig_cache;
mod service_rate;
#[cfg(test)]
mod test_support;
mod ticket;
mod timeline;
mod turns;
mod worker_pool;

pub use calibration_lookup::{CalibrationLookup, UnusableCalibration};
pub use default_models::DefaultModels;
pub use engine::{Engine, EngineOptions, Observation};
pub use error::PipelineError;
pub use in_flight::{Stall, StalledWork};
pub use job::{DetectJob, DetectedFrame, JobImage};
pub use network::BatchOptions;
pub use planned_views::{PlannedView, PlannedViews};
pub use report::{
    CalibrationUsed, DetectionReport, ModelUsed, Person, Search, StageTimings, ViewCounts,
    ZoneCount,
};
pub use ticket::Ticket;
pub use timeline::{Stage, StageSpan, Timeline};
pub use worker_pool::WorkerPool;
