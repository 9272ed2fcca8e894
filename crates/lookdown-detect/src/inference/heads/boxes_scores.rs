//! Heads whose boxes and scores are outputs of their own.

use std::iter;

use lookdown_lens::geometry::Posture;
use serde::Deserialize;

use super::{
    decoder::{CandidateCollector, Decoder, Selected, corners_around, four},
    score::{Activation, ClassActivation},
    shape::{Axis, Batch, Output, TensorView, boxes_and_scores, named},
};

/// Graphs that decode boxes and scores.
///
/// Boxes `[views, candidates, 4]` (`x_min, y_min, x_max, y_max`, view pixels) and scores
/// `[views, candidates]` or `[views, candidates, 1]` of being a person, 0 to 1. A network that
/// tells postures has scores `[views, candidates, 1 + postures]`: of a person, and of one in each
/// posture.
///
/// ```toml
/// [output]              # optional
/// head = "boxes_scores"
/// boxes = "boxes"       # default
/// scores = "scores"     # default
/// postures = ["lying", "low"]   # default: none
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BoxesScoresHead {
    /// The output with the boxes.
    pub boxes: String,
    /// The output with the scores.
    pub scores: String,
    /// The postures of the scores after the first.
    pub postures: Vec<Posture>,
}

impl Default for BoxesScoresHead {
    fn default() -> Self {
        Self {
            boxes: "boxes".to_owned(),
            scores: "scores".to_owned(),
            postures: Vec::new(),
        }
    }
}

impl Decoder for BoxesScoresHead {
    fn select<'o>(&self, outputs: &'o [Output<'o>], batch: &Batch) -> Selected<'o> {
        let boxes = named(outputs, &self.boxes)?;
        let scores = named(outputs, &self.scores)?;
        let candidates = Axis::AtLeast(0, "candidates");
        let classes = 1 + self.postures.len();
        let by_class = [Axis::Views, candidates, Axis::Exactly(classes)];
        let has_classes = classes > 1 || scores.dimensions.len() == by_class.len();
        let scores_axes = if has_classes {
            &by_class[..]
        } else {
            &by_class[..2]
        };
        batch.require(&[
            (boxes, &[Axis::Views, candidates, Axis::Exactly(4)]),
            (scores, scores_axes),
        ])?;
        Ok(vec![boxes, scores])
    }

    fn decode(&self, tensors: &[&TensorView<'_>], collector: &mut CandidateCollector) {
        let (boxes, scores) = (tensors[0], tensors[1]);
        let classes = 1 + self.postures.len();
        let postures = iter::once(None).chain(self.postures.iter().copied().map(Some));
        for (view, (boxes, scores)) in boxes.views().zip(scores.views()).enumerate() {
            for (corners, scores) in boxes.chunks_exact(4).zip(scores.chunks_exact(classes)) {
                for (posture, &raw) in postures.clone().zip(scores) {
                    let score = Activation::None.score(raw, collector.floor);
                    if let Some(score) = collector.judge(score) {
                        collector.add(view, score, posture, four(corners));
                    }
                }
            }
        }
    }
}

/// DETR and its successors (RT-DETR, D-FINE, RF-DETR) before decoding: class logits `[views,
/// queries, classes]` and boxes `[views, queries, 4]` (center x, center y, width, height, as shares
/// of the view).
///
/// The score is a sigmoid per class. The original DETR uses a softmax over the classes and "no
/// object".
///
/// Sources: Carion et al., "End-to-End Object Detection with Transformers", 2020, section 3;
/// Zhao et al., "DETRs Beat YOLOs on Real-time Object Detection", 2024.
///
/// ```toml
/// [output]
/// head = "detr"
/// person_class = 0               # 80 COCO classes; RF-DETR, DETR, numbered as in COCO: 1
/// score_activation = "sigmoid"   # default; DETR: "softmax"
/// # boxes = "pred_boxes"         # if the shapes are ambiguous
/// # scores = "logits"
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DetrHead {
    /// Index of the person among the classes.
    pub person_class: u16,
    /// Activation applied to the class scores.
    #[serde(default)]
    pub score_activation: ClassActivation,
    /// The output with the boxes. Default: the one whose last axis is 4.
    #[serde(default)]
    pub boxes: Option<String>,
    /// The output with the class scores. Default: the other one with three axes.
    #[serde(default)]
    pub scores: Option<String>,
}

impl Decoder for DetrHead {
    fn select<'o>(&self, outputs: &'o [Output<'o>], batch: &Batch) -> Selected<'o> {
        let names = [self.boxes.as_deref(), self.scores.as_deref()];
        let [boxes, scores] = boxes_and_scores(outputs, names)?;
        let queries = Axis::AtLeast(0, "queries");
        let classes = Axis::AtLeast(usize::from(self.person_class) + 1, "classes");
        batch.require(&[
            (boxes, &[Axis::Views, queries, Axis::Exactly(4)]),
            (scores, &[Axis::Views, queries, classes]),
        ])?;
        Ok(vec![boxes, scores])
    }

    fn decode(&self, tensors: &[&TensorView<'_>], collector: &mut CandidateCollector) {
        let (boxes, scores) = (tensors[0], tensors[1]);
        let person = usize::from(self.person_class);
        let [view_width, view_height] =
            [collector.batch.width, collector.batch.height].map(f64::from);
        for (view, (boxes, all_scores)) in boxes.views().zip(scores.views()).enumerate() {
            let queries = boxes
                .chunks_exact(4)
                .zip(all_scores.chunks_exact(scores.shape[2]));
            for (sides, scores) in queries {
                let score = self.score_activation.score(scores, person, collector.floor);
                collector.offer(view, score, || {
                    let [x, y, width, height] = four(sides);
                    let center = [x * view_width, y * view_height];
                    corners_around(center, [width * view_width, height * view_height])
                });
            }
        }
    }
}
