#![doc = include_str!("../README.md")]
//!
//! [`geometry`] projects with a camera, [`self_calibration`] finds one.

pub mod geometry;
pub mod saturating;
pub mod self_calibration;
