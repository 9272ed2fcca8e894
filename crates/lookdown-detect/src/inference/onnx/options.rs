//! The options for running a model.

use std::num::NonZeroUsize;

use crate::inference::{CandidateOptions, Device};

/// Options for running a model.
#[derive(Debug, Clone, PartialEq)]
pub struct OnnxOptions {
    /// Device of the network.
    pub device: Device,
    /// Threads within one run of the network.
    pub threads: NonZeroUsize,
    /// Limits on the candidates that are kept.
    pub candidates: CandidateOptions,
}
