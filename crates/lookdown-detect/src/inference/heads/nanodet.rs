//! `NanoDet`.

use std::num::NonZeroU32;

use serde::Deserialize;

use super::{
    candidate_collector::CandidateCollector,
    decoder::{Decoder, Selected},
    grid::{Grid, pyramid, pyramid_len},
    outputs::named_or_only,
    score::Activation,
    shape::{Axis, Batch},
    tensor::{Output, TensorView},
};

/// `NanoDet`: `[views, cells, classes + 4 (reg_max + 1)]`. Each cell has the class scores, then
/// logits of the distances 0 to `reg_max` strides for the left, top, right and bottom side. Cells
/// are ordered level by level, row by row.
///
/// A side's distance from the cell's prior is `stride · Σ i · softmax(logits)_i`.
///
/// Sources: Li et al., "Generalized Focal Loss", 2020, equation 3 and following;
/// `nanodet_plus_head.py` and `gfl_head.py` of the reference implementation, whose export
/// applies the sigmoid.
///
/// ```toml
/// [output]
/// head = "nanodet"
/// person_class = 0             # COCO, 80 classes
/// # These are the defaults, for NanoDet-Plus:
/// strides = [8, 16, 32, 64]
/// reg_max = 7
/// prior = "corner"
/// score_activation = "none"    # or "sigmoid"
/// # NanoDet-m: strides = [8, 16, 32], prior = "center"; NanoDet-g: reg_max = 10 too
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NanodetHead {
    /// Index of the person among the classes.
    pub person_class: u16,
    /// Pixels per cell of each level, in the network's order.
    #[serde(default = "plus_strides")]
    pub strides: Vec<NonZeroU32>,
    /// The greatest distance of a side, strides.
    #[serde(default = "plus_reg_max")]
    pub reg_max: u16,
    /// Position within a cell from which distances are measured.
    #[serde(default)]
    pub prior: PriorPosition,
    /// Activation applied to the class scores.
    #[serde(default)]
    pub score_activation: Activation,
    /// The output to read. Default: the only one.
    #[serde(default)]
    pub name: Option<String>,
}

/// Position of the prior within a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PriorPosition {
    /// The top-left corner, as in NanoDet-Plus.
    #[default]
    Corner,
    /// The center, as in `NanoDet` before Plus.
    Center,
}

fn plus_strides() -> Vec<NonZeroU32> {
    (3..7).filter_map(|i| NonZeroU32::new(1 << i)).collect()
}

fn plus_reg_max() -> u16 {
    7
}

impl NanodetHead {
    fn bins(&self) -> usize {
        usize::from(self.reg_max) + 1
    }

    fn corners(&self, logits: &[f32], grid: Grid, [column, row]: [f64; 2]) -> [f64; 4] {
        let shift = match self.prior {
            PriorPosition::Corner => 0.0,
            PriorPosition::Center => 0.5,
        };
        let (x, y) = (column + shift, row + shift);
        let [left, top, right, bottom] =
            [0, 1, 2, 3].map(|side| expected_bin(&logits[side * self.bins()..][..self.bins()]));
        let [x_min, y_min] = grid.pixels([x - left, y - top]);
        let [x_max, y_max] = grid.pixels([x + right, y + bottom]);
        [x_min, y_min, x_max, y_max]
    }
}

/// The mean bin of a distribution given by its logits.
fn expected_bin(logits: &[f32]) -> f64 {
    let greatest = f64::from(logits.iter().copied().fold(f32::NEG_INFINITY, f32::max));
    let (mut sum, mut moment, mut bin) = (0.0, 0.0, 0.0);
    for &logit in logits {
        let weight = (f64::from(logit) - greatest).exp();
        sum += weight;
        moment += bin * weight;
        bin += 1.0;
    }
    moment / sum
}

impl Decoder for NanodetHead {
    fn select<'o>(&self, outputs: &'o [Output<'o>], batch: &Batch) -> Selected<'o> {
        let candidates = named_or_only(outputs, self.name.as_deref())?;
        let cells = Axis::Exactly(pyramid_len(&self.strides, batch));
        let classes = usize::from(self.person_class) + 1;
        let columns = Axis::AtLeast(classes + 4 * self.bins(), "columns");
        batch.require(&[(candidates, &[Axis::Views, cells, columns])])?;
        Ok(vec![candidates])
    }

    fn decode(&self, tensors: &[&TensorView<'_>], collector: &mut CandidateCollector) {
        let batch = collector.batch;
        let candidates = tensors[0];
        let columns = candidates.shape[2];
        let classes = columns - 4 * self.bins();
        let person = usize::from(self.person_class);
        for (view, values) in candidates.views().enumerate() {
            let rows = values.chunks_exact(columns);
            for (values, (grid, cell)) in rows.zip(pyramid(&self.strides, &batch)) {
                let score = self.score_activation.score(values[person], collector.floor);
                collector.offer(view, score, || self.corners(&values[classes..], grid, cell));
            }
        }
    }
}
