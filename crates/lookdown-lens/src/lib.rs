#![doc = include_str!("../README.md")]
//!
//! [`calibration`] reads a file of any of its formats into a checked camera; [`geometry`] projects
//! with it.

pub mod calibration;
pub mod geometry;
pub mod revision;
pub mod self_calibration;
pub mod warning;
