//! Graphs that decode boxes and scores.

use serde::Deserialize;

use super::{
    candidate_collector::{CandidateCollector, four},
    decoder::{Decoder, Selected},
    outputs::named,
    score::Activation,
    shape::{Axis, Batch},
    tensor::{Output, TensorView},
};

/// Boxes `[views, candidates, 4]` (`x_min, y_min, x_max, y_max`, view pixels) and scores
/// `[views, candidates]` or `[views, candidates, 1]` of being a person, 0 to 1.
///
/// ```toml
/// [output]              # optional
/// head = "boxes_scores"
/// boxes = "boxes"       # default
/// scores = "scores"     # default
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BoxesScoresHead {
    /// The output with the boxes.
    pub boxes: String,
    /// The output with the scores.
    pub scores: String,
}

impl Default for BoxesScoresHead {
    fn default() -> Self {
        Self {
            boxes: "boxes".to_owned(),
            scores: "scores".to_owned(),
        }
    }
}

impl Decoder for BoxesScoresHead {
    fn select<'o>(&self, outputs: &'o [Output<'o>], batch: &Batch) -> Selected<'o> {
        let boxes = named(outputs, &self.boxes)?;
        let scores = named(outputs, &self.scores)?;
        let candidates = Axis::AtLeast(0, "candidates");
        let one_class = [Axis::Views, candidates, Axis::Exactly(1)];
        let has_classes = scores.dimensions.len() == one_class.len();
        let scores_axes = if has_classes {
            &one_class[..]
        } else {
            &one_class[..2]
        };
        batch.require(&[
            (boxes, &[Axis::Views, candidates, Axis::Exactly(4)]),
            (scores, scores_axes),
        ])?;
        Ok(vec![boxes, scores])
    }

    fn decode(&self, tensors: &[&TensorView<'_>], collector: &mut CandidateCollector) {
        let (boxes, scores) = (tensors[0], tensors[1]);
        for (view, (boxes, scores)) in boxes.views().zip(scores.views()).enumerate() {
            for (corners, &raw) in boxes.chunks_exact(4).zip(scores) {
                let score = Activation::None.score(raw, collector.floor);
                collector.offer(view, score, || four(corners));
            }
        }
    }
}
