//! Output heads, which decode the outputs of a network to person boxes. Pure functions.
//!
//! A [`Head`] is the `[output]` table of a model's manifest. Every head reads only the score of the
//! person class and drops candidates below the floor before it computes a box. Boxes are in view
//! pixels, clipped to the view and not deduplicated. The arithmetic uses `f64`.

mod boxes_scores;
mod decoder;
mod end_to_end;
mod grid;
mod score;
mod shape;

pub use self::{
    boxes_scores::{BoxesScoresHead, DetrHead},
    end_to_end::{Column, EndToEndHead, EndToEndUnit},
    grid::{NanodetHead, PriorPosition, YoloV2Head, YoloV8Head, YoloV8Layout, YoloxHead},
    score::{Activation, ClassActivation},
    shape::{OutputShape, TensorView},
};

use lookdown_imaging::NetworkInput;
use serde::Deserialize;
use strum::IntoStaticStr;

use self::{
    decoder::{CandidateCollector, Decoder},
    shape::{Batch, Output},
};
use super::{HeadOutput, InferenceError};

/// Declares [`Head`]: for each head a description, a variant and the type of its fields.
macro_rules! heads {
    ($($(#[doc = $description:literal])+ $variant:ident($head:ty),)+) => {
        /// Decoder of a model's outputs. In a manifest: `head = "yolox"` and the fields of that
        /// head.
        #[derive(Debug, Clone, PartialEq, Deserialize, IntoStaticStr)]
        #[serde(tag = "head", rename_all = "snake_case")]
        #[strum(serialize_all = "snake_case")]
        pub enum Head {
            $($(#[doc = $description])+ $variant($head),)+
        }

        impl Head {
            /// Returns the outputs that the head expects, as a phrase.
            pub fn description(&self) -> &'static str {
                match self {
                    $(Self::$variant(_) => concat!($($description),+).trim_ascii_start(),)+
                }
            }

            fn decoder(&self) -> &dyn Decoder {
                match self {
                    $(Self::$variant(head) => head,)+
                }
            }
        }
    };
}

heads! {
    /// Boxes and person scores decoded by the graph.
    BoxesScores(BoxesScoresHead),
    /// YOLOv2: one grid of anchors, softmax over classes.
    YoloV2(YoloV2Head),
    /// YOLOX: a grid per scale without anchors, with objectness.
    Yolox(YoloxHead),
    /// Distances to the sides as distributions.
    Nanodet(NanodetHead),
    /// Decoded boxes and class scores in one tensor, as of YOLOv8 and its successors.
    YoloV8(YoloV8Head),
    /// The DETR family: a set of queries.
    Detr(DetrHead),
    /// Final detections with overlaps suppressed by the graph.
    EndToEnd(EndToEndHead),
}

/// Limits on the candidates that are kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CandidateOptions {
    /// Boxes with a lower score are dropped, 0 to 1.
    pub score_floor: f64,
    /// Largest number of boxes per view. The best are kept.
    pub max_detections_per_view: usize,
}

impl CandidateOptions {
    /// The limits that suit every profile.
    pub const DEFAULT: Self = Self {
        score_floor: 0.05,
        max_detections_per_view: 300,
    };
}

impl Head {
    /// Returns the name, as in manifests.
    pub fn name(&self) -> &'static str {
        self.into()
    }

    /// Returns true if there are scores of people in certain postures.
    pub fn tells_postures(&self) -> bool {
        matches!(self, Self::BoxesScores(head) if !head.postures.is_empty())
    }

    /// Checks that a model with these outputs and an input of `(width, height)` pixels can be
    /// decoded. Dimensions that the model leaves open are -1.
    ///
    /// # Errors
    /// One sentence about the model ("its output …"): what was found and what is needed.
    pub fn check(&self, outputs: &[OutputShape<'_>], input: (u32, u32)) -> Result<(), String> {
        let batch = Batch {
            views: None,
            width: input.0,
            height: input.1,
        };
        let outputs = Output::all(outputs.iter().map(|output| (output.name, output.shape)));
        self.decoder().select(&outputs, &batch).map(drop)
    }

    /// Decodes the persons in `views` views with a score of at least `floor` (0 to 1).
    ///
    /// # Errors
    /// [`InferenceError::Run`] when an output is missing, its shape does not fit this head, or its
    /// scores are not probabilities although the manifest declares them so.
    pub fn decode(
        &self,
        outputs: &[TensorView<'_>],
        views: usize,
        input: &NetworkInput,
        floor: f64,
    ) -> Result<HeadOutput, InferenceError> {
        let batch = Batch {
            views: Some(views),
            width: input.width,
            height: input.height,
        };
        let known = Output::all(outputs.iter().map(|output| (output.name, output.shape)));
        let mut collector = CandidateCollector::new(batch, floor);
        outputs
            .iter()
            .try_for_each(TensorView::check_len)
            .and_then(|()| self.decoder().select(&known, &batch))
            .and_then(|selected| {
                let tensors: Vec<_> = selected
                    .iter()
                    .map(|output| &outputs[output.index])
                    .collect();
                self.decoder().decode(&tensors, &mut collector);
                collector.finish()
            })
            .map_err(InferenceError::Run)
    }
}

impl Default for Head {
    fn default() -> Self {
        Self::BoxesScores(BoxesScoresHead::default())
    }
}

#[cfg(test)]
mod properties;

#[cfg(test)]
mod tests;
