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
    /// Views of every run of a network that takes any number; black views take the place of missing
    /// ones. A GPU needs it: it prepares a network for each new number, which takes longer than a
    /// run. `None`: as many as there are.
    pub views_per_run: Option<NonZeroUsize>,
    /// Limits on the candidates that are kept.
    pub candidates: CandidateOptions,
}
