//! The interface of all heads.

use super::{
    candidate_collector::CandidateCollector,
    shape::Batch,
    tensor::{OutputShape, TensorView},
};

/// Interface of all heads. `batch.views` is known in [`Decoder::decode`] only.
pub(super) trait Decoder {
    /// Checks that outputs of these shapes can be decoded. The error is a sentence.
    fn check(&self, outputs: &[OutputShape<'_>], batch: &Batch) -> Result<(), String>;

    /// Checks the outputs, then passes every candidate to `collector`.
    fn decode(
        &self,
        outputs: &[TensorView<'_>],
        batch: &Batch,
        collector: &mut CandidateCollector,
    ) -> Result<(), String>;
}
