//! `YOLOv8` and its successors.

use std::num::NonZeroU32;

use serde::Deserialize;

use super::{
    candidate_collector::{CandidateCollector, corners_around},
    decoder::{Decoder, Selected},
    grid::{default_strides, pyramid_len},
    outputs::named_or_only,
    score::Activation,
    shape::{Axis, Batch},
    tensor::{Output, TensorView},
};

/// `YOLOv8`, YOLO11 and relatives, exported without suppression: `[views, 4 + classes, cells]`.
/// Each cell has center x, center y, width, height (pixels) and class scores. Further channels
/// (mask coefficients, key points) are ignored.
///
/// Source: the export of the reference implementation. The graph decodes the boxes and applies the
/// sigmoids.
///
/// ```toml
/// [output]
/// head = "yolo_v8"
/// person_class = 0              # COCO, 80 classes
/// strides = [8, 16, 32]         # default; they give the number of cells
/// layout = "channels_first"     # default; or "cells_first": [views, cells, 4 + classes]
/// score_activation = "none"     # default; or "sigmoid"
/// # name = "output0"            # if the model also has other outputs
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct YoloV8Head {
    /// Index of the person among the classes.
    pub person_class: u16,
    /// Pixels per cell of each level.
    #[serde(default = "default_strides")]
    pub strides: Vec<NonZeroU32>,
    /// Order of the axes.
    #[serde(default)]
    pub layout: YoloV8Layout,
    /// Activation applied to the class scores.
    #[serde(default)]
    pub score_activation: Activation,
    /// The output to read. Default: the only one.
    #[serde(default)]
    pub name: Option<String>,
}

/// The order of the axes after the views.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum YoloV8Layout {
    /// Channels, cells.
    #[default]
    ChannelsFirst,
    /// Cells, channels.
    CellsFirst,
}

impl Decoder for YoloV8Head {
    fn select<'o>(&self, outputs: &'o [Output<'o>], batch: &Batch) -> Selected<'o> {
        let candidates = named_or_only(outputs, self.name.as_deref())?;
        let cells = Axis::Exactly(pyramid_len(&self.strides, batch));
        let channels = Axis::AtLeast(5 + usize::from(self.person_class), "channels");
        let axes = match self.layout {
            YoloV8Layout::ChannelsFirst => [Axis::Views, channels, cells],
            YoloV8Layout::CellsFirst => [Axis::Views, cells, channels],
        };
        batch.require(&[(candidates, &axes)])?;
        Ok(vec![candidates])
    }

    fn decode(&self, tensors: &[&TensorView<'_>], collector: &mut CandidateCollector) {
        let candidates = tensors[0];
        let (cells, per_channel, per_cell) = match self.layout {
            YoloV8Layout::ChannelsFirst => (candidates.shape[2], candidates.shape[2], 1),
            YoloV8Layout::CellsFirst => (candidates.shape[1], 1, candidates.shape[2]),
        };
        let person = 4 + usize::from(self.person_class);
        for (view, values) in candidates.views().enumerate() {
            for cell in 0..cells {
                let value = |channel: usize| values[channel * per_channel + cell * per_cell];
                let score = self.score_activation.score(value(person), collector.floor);
                collector.offer(view, score, || {
                    let [x, y, width, height] = [0, 1, 2, 3].map(|side| f64::from(value(side)));
                    corners_around([x, y], [width, height])
                });
            }
        }
    }
}
