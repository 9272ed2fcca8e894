//! Grids of cells over the network's input, and the heads whose candidates are their cells.

use std::num::NonZeroU32;

use serde::Deserialize;

use super::{
    decoder::{CandidateCollector, Decoder, Selected, corners_around, four},
    score::{Activation, sigmoid},
    shape::{Axis, Batch, Output, TensorView, check_positive, named_or_only},
};

/// Cells over the input, row by row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grid {
    columns: u32,
    rows: u32,
    /// Width and height of a cell, pixels.
    pub(super) cell: [f64; 2],
}

impl Grid {
    /// The axes of a map over the whole input, rows before columns.
    pub(super) fn axes(batch: &Batch) -> [Axis; 2] {
        [
            Axis::Dividing(batch.height, "rows"),
            Axis::Dividing(batch.width, "columns"),
        ]
    }

    /// The cells of a map whose last two axes are [`Grid::axes`].
    pub(super) fn from_map(map: &TensorView<'_>, batch: &Batch) -> Self {
        let side = |from_last: usize| {
            let index = map.shape.len().checked_sub(from_last);
            let cells = index.and_then(|index| map.shape.get(index));
            cells.map_or(0, |&cells| u32::try_from(cells).unwrap_or(0))
        };
        let (columns, rows) = (side(1), side(2));
        let cell = [
            f64::from(batch.width) / f64::from(columns),
            f64::from(batch.height) / f64::from(rows),
        ];
        Self {
            columns,
            rows,
            cell,
        }
    }

    /// Square cells of `stride` pixels. The last ones may reach beyond the input.
    pub(super) fn from_stride(stride: NonZeroU32, batch: &Batch) -> Self {
        let side = f64::from(stride.get());
        Self {
            columns: batch.width.div_ceil(stride.get()),
            rows: batch.height.div_ceil(stride.get()),
            cell: [side, side],
        }
    }

    /// Number of cells.
    pub(super) fn len(self) -> usize {
        (self.columns as usize).saturating_mul(self.rows as usize)
    }

    /// Column and row of every cell, row by row.
    pub(super) fn cells(self) -> impl Iterator<Item = [f64; 2]> {
        let columns = self.columns;
        (0..self.rows)
            .flat_map(move |row| (0..columns).map(move |column| [column, row].map(f64::from)))
    }

    /// The pixel position of a point given in cells.
    pub(super) fn pixels(self, [column, row]: [f64; 2]) -> [f64; 2] {
        [column * self.cell[0], row * self.cell[1]]
    }
}

/// The usual strides of a feature pyramid.
pub(super) fn default_strides() -> Vec<NonZeroU32> {
    [8, 16, 32]
        .into_iter()
        .filter_map(NonZeroU32::new)
        .collect()
}

/// Number of cells of a pyramid over all its levels.
pub(super) fn pyramid_len(strides: &[NonZeroU32], batch: &Batch) -> usize {
    strides
        .iter()
        .map(|&stride| Grid::from_stride(stride, batch).len())
        .fold(0, usize::saturating_add)
}

/// Each cell of a pyramid, level by level, with its grid.
pub(super) fn pyramid(
    strides: &[NonZeroU32],
    batch: &Batch,
) -> impl Iterator<Item = (Grid, [f64; 2])> {
    strides.iter().flat_map(|&stride| {
        let grid = Grid::from_stride(stride, batch);
        grid.cells().map(move |cell| (grid, cell))
    })
}

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

/// `YOLOv2`'s region layer before decoding: `[views, anchors × (5 + classes), rows, columns]`, with
/// `t_x, t_y, t_w, t_h, t_o` and the class logits per anchor.
///
/// In cells: center `(σ(t_x) + column, σ(t_y) + row)`, size `(p_w e^t_w, p_h e^t_h)` for the anchor
/// `(p_w, p_h)`. Score: `σ(t_o) · softmax(classes)`.
///
/// Source: Redmon and Farhadi, "YOLO9000: Better, Faster, Stronger", 2017, section 2 (direct
/// location prediction).
///
/// ```toml
/// [output]
/// head = "yolo_v2"
/// person_class = 14   # Pascal VOC, alphabetical
/// anchors = [[1.3221, 1.73145], [3.19275, 4.00944], [5.05587, 8.09892], [9.47112, 4.84053],
///     [11.2364, 10.0071]]
/// ```
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct YoloV2Head {
    /// Index of the person among the classes.
    pub person_class: u16,
    /// Width and height of each anchor, cells.
    pub anchors: Vec<[f64; 2]>,
    /// The output to read. Default: the only one.
    #[serde(default)]
    pub name: Option<String>,
}

impl Decoder for YoloV2Head {
    fn select<'o>(&self, outputs: &'o [Output<'o>], batch: &Batch) -> Selected<'o> {
        check_positive("anchors", self.anchors.as_flattened())?;
        let map = named_or_only(outputs, self.name.as_deref())?;
        let channels = Axis::PerAnchor {
            anchors: self.anchors.len(),
            at_least: 6 + usize::from(self.person_class),
        };
        let [rows, columns] = Grid::axes(batch);
        batch.require(&[(map, &[Axis::Views, channels, rows, columns])])?;
        Ok(vec![map])
    }

    fn decode(&self, tensors: &[&TensorView<'_>], collector: &mut CandidateCollector) {
        let map = tensors[0];
        let grid = Grid::from_map(map, &collector.batch);
        let channels = map.shape[1] / self.anchors.len();
        let person = usize::from(self.person_class);
        let floor = collector.floor;
        let mut logits = Vec::new();
        for (view, values) in map.views().enumerate() {
            let per_anchor = values.chunks_exact(channels * grid.len());
            for (values, &[p_w, p_h]) in per_anchor.zip(&self.anchors) {
                let planes: Vec<&[f32]> = values.chunks_exact(grid.len()).collect();
                let (location, classes) = planes.split_at(5);
                for (index, [column, row]) in grid.cells().enumerate() {
                    let score = floor.sigmoid(location[4][index]).times(floor, || {
                        logits.clear();
                        logits.extend(classes.iter().map(|plane| plane[index]));
                        floor.softmax(&logits, person)
                    });
                    collector.offer(view, score, || {
                        let [t_x, t_y, t_w, t_h] =
                            [0, 1, 2, 3].map(|plane| f64::from(location[plane][index]));
                        let center = grid.pixels([sigmoid(t_x) + column, sigmoid(t_y) + row]);
                        let size = grid.pixels([p_w * t_w.exp(), p_h * t_h.exp()]);
                        corners_around(center, size)
                    });
                }
            }
        }
    }
}

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
