#![doc = include_str!("../README.md")]
//!
//! [`Detector`] is the entrance for one process. The parts below it are for servers: [`pipeline`]
//! has the engine and the queue of frames, [`inference`] the networks. The pixels of a frame are in
//! [`lookdown_imaging`].

pub mod detection;
mod detector;
pub mod fairness;
pub mod inference;
pub mod metrics;
pub mod open_inference;
pub mod parameters;
pub mod pipeline;

pub use detector::{
    DEFAULT_MODELS, DEFAULT_ONNX_RUNTIME, Detector, DetectorError, DetectorOptions,
};
