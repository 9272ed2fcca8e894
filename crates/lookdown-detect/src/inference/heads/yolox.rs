//! YOLOX.

use std::num::NonZeroU32;

use serde::Deserialize;

use super::{
    candidate_collector::{CandidateCollector, corners_around, four},
    decoder::{Decoder, Selected},
    grid::{Grid, default_strides, pyramid, pyramid_len},
    outputs::named_or_only,
    score::Activation,
    shape::{Axis, Batch},
    tensor::{Output, TensorView},
};

/// YOLOX: `[views, cells, 5 + classes]`, with `t_x, t_y, t_w, t_h`, objectness and class scores per
/// cell. Cells are ordered level by level, row by row.
///
/// Center `((t_x + column) · stride, (t_y + row) · stride)`, size `(stride · e^t_w, stride ·
/// e^t_h)`. Score: `objectness · class`.
///
/// Sources: Ge et al., "YOLOX: Exceeding YOLO Series in 2021", section 2.1; `decode_outputs` of
/// the reference implementation, whose export applies the sigmoids but does not decode boxes.
///
/// ```toml
/// [output]
/// head = "yolox"
/// person_class = 0            # COCO, 80 classes
/// strides = [8, 16, 32]       # default
/// decode_in_graph = false     # default; true: center and size are in pixels
/// score_activation = "none"   # default; or "sigmoid"
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct YoloxHead {
    /// Index of the person among the classes.
    pub person_class: u16,
    /// Pixels per cell of each level, in the network's order.
    #[serde(default = "default_strides")]
    pub strides: Vec<NonZeroU32>,
    /// True if the graph returns boxes as center and size in pixels.
    #[serde(default)]
    pub decode_in_graph: bool,
    /// Activation applied to objectness and class scores.
    #[serde(default)]
    pub score_activation: Activation,
    /// The output to read. Default: the only one.
    #[serde(default)]
    pub name: Option<String>,
}

impl YoloxHead {
    fn corners(&self, values: &[f32], grid: Grid, [column, row]: [f64; 2]) -> [f64; 4] {
        let [x, y, width, height] = four(values);
        if self.decode_in_graph {
            return corners_around([x, y], [width, height]);
        }
        let center = grid.pixels([x + column, y + row]);
        corners_around(center, grid.pixels([width.exp(), height.exp()]))
    }
}

impl Decoder for YoloxHead {
    fn select<'o>(&self, outputs: &'o [Output<'o>], batch: &Batch) -> Selected<'o> {
        let candidates = named_or_only(outputs, self.name.as_deref())?;
        let cells = Axis::Exactly(pyramid_len(&self.strides, batch));
        let columns = Axis::AtLeast(6 + usize::from(self.person_class), "columns");
        batch.require(&[(candidates, &[Axis::Views, cells, columns])])?;
        Ok(vec![candidates])
    }

    fn decode(&self, tensors: &[&TensorView<'_>], collector: &mut CandidateCollector) {
        let batch = collector.batch;
        let candidates = tensors[0];
        let person = 5 + usize::from(self.person_class);
        let floor = collector.floor;
        for (view, values) in candidates.views().enumerate() {
            let rows = values.chunks_exact(candidates.shape[2]);
            for (values, (grid, cell)) in rows.zip(pyramid(&self.strides, &batch)) {
                let score = self
                    .score_activation
                    .score(values[4], floor)
                    .times(floor, || self.score_activation.score(values[person], floor));
                collector.offer(view, score, || self.corners(values, grid, cell));
            }
        }
    }
}
