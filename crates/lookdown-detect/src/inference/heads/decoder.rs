//! The interface of all heads.

use super::{
    candidate_collector::CandidateCollector,
    shape::Batch,
    tensor::{Output, TensorView},
};

/// The outputs that a head reads, or a sentence about those that it cannot read.
pub(super) type Selected<'o> = Result<Vec<&'o Output<'o>>, String>;

/// Interface of all heads. `batch.views` is known in a run only.
pub(super) trait Decoder {
    /// Selects the outputs that are decoded, and checks their shapes.
    fn select<'o>(&self, outputs: &'o [Output<'o>], batch: &Batch) -> Selected<'o>;

    /// Passes every candidate of the selected outputs to `collector`.
    fn decode(&self, tensors: &[&TensorView<'_>], collector: &mut CandidateCollector);
}
