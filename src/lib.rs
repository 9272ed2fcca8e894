//! Lookdown detects persons in the images of ceiling fisheye cameras.
//!
//! A frame is rendered into upright perspective views. A person detector trained on ordinary
//! photographs runs on them, and its boxes are mapped back to the frame and merged.
//! `ARCHITECTURE.md` describes the modules and the processing of one frame. Dependencies between
//! the modules point in one direction.

pub mod access;
pub mod annotated_image;
pub mod annotation_formats;
pub mod api;
pub mod app;
pub mod calibration_store;
pub mod cameras;
pub mod cli;
pub mod metrics;
pub mod mqtt;
pub mod probe;
pub mod reference_counts;
pub mod results;
pub mod room_calibration;
mod rounding;
mod samples;
pub mod settings;
mod suggestions;
pub mod telemetry;
pub mod tls;
pub mod views;
