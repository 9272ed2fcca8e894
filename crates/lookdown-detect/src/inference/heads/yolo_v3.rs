//! `YOLOv3`.

use serde::Deserialize;

use super::{
    Decoder,
    candidate_collector::{CandidateCollector, corners_around},
    grid::Grid,
    outputs::{named, names},
    score::sigmoid,
    shape::{Axis, Batch, check_positive},
    tensor::{Output, OutputShape, TensorView},
};

/// `YOLOv3`'s maps before decoding, one per scale: `[views, anchors × (5 + classes), rows,
/// columns]`, with `t_x, t_y, t_w, t_h, t_o` and the class logits per anchor.
///
/// Centre `(σ(t_x) + column, σ(t_y) + row)` cells, size `(p_w e^t_w, p_h e^t_h)` pixels for the
/// anchor `(p_w, p_h)`. Score: `σ(t_o) · σ(class)`.
///
/// Source: Redmon and Farhadi, "`YOLOv3`: An Incremental Improvement", 2018, section 2.
///
/// ```toml
/// [output]
/// head = "yolo_v3"
/// person_class = 0   # COCO, 80 classes
/// anchors = [[10, 14], [23, 27], [37, 58], [81, 82], [135, 169], [344, 319]]   # YOLOv3-tiny
/// masks = [[3, 4, 5], [1, 2, 3]]   # anchors of each map, in the order of the outputs
/// # names = ["coarse", "fine"]     # if the model also has other outputs
/// ```
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct YoloV3Head {
    /// Index of the person among the classes.
    pub person_class: u16,
    /// Width and height of each anchor, pixels of the network's input.
    pub anchors: Vec<[f64; 2]>,
    /// Indices of the anchors of each map.
    pub masks: Vec<Vec<usize>>,
    /// Output of each map. Default: all outputs, in the model's order.
    #[serde(default)]
    pub names: Option<Vec<String>>,
}

/// One map and its anchors.
struct Scale<'o, T> {
    map: &'o T,
    anchors: Vec<[f64; 2]>,
}

impl YoloV3Head {
    fn select<'o, T: Output>(
        &self,
        outputs: &'o [T],
        batch: &Batch,
    ) -> Result<Vec<Scale<'o, T>>, String> {
        check_positive("anchors", self.anchors.as_flattened())?;
        let maps: Vec<&T> = match &self.names {
            Some(names) => names
                .iter()
                .map(|name| named(outputs, name))
                .collect::<Result<_, _>>()?,
            None => outputs.iter().collect(),
        };
        if maps.len() != self.masks.len() {
            return Err(format!(
                "{} `masks` in the manifest's [output] do not fit its {} maps; select the \
                 outputs to read from {} with `names`",
                self.masks.len(),
                maps.len(),
                names(outputs)
            ));
        }
        let [rows, columns] = Grid::axes(batch);
        let mut scales = Vec::new();
        for (map, mask) in maps.into_iter().zip(&self.masks) {
            let channels = Axis::PerAnchor {
                anchors: mask.len(),
                at_least: 6 + usize::from(self.person_class),
            };
            batch.require(&[(map, &[Axis::Views, channels, rows, columns])])?;
            let anchors = mask.iter().map(|&anchor| self.anchor(anchor));
            let anchors = anchors.collect::<Result<_, _>>()?;
            scales.push(Scale { map, anchors });
        }
        Ok(scales)
    }

    fn anchor(&self, index: usize) -> Result<[f64; 2], String> {
        self.anchors.get(index).copied().ok_or_else(|| {
            format!(
                "`masks` in the manifest's [output] names anchor {index}, but there are {} \
                 `anchors`, counted from 0",
                self.anchors.len()
            )
        })
    }
}

impl Decoder for YoloV3Head {
    fn check(&self, outputs: &[OutputShape<'_>], batch: &Batch) -> Result<(), String> {
        self.select(outputs, batch).map(drop)
    }

    fn decode(
        &self,
        outputs: &[TensorView<'_>],
        batch: &Batch,
        finds: &mut CandidateCollector,
    ) -> Result<(), String> {
        let person = 5 + usize::from(self.person_class);
        let floor = finds.floor;
        for Scale { map, anchors } in self.select(outputs, batch)? {
            let grid = Grid::of_map(map, batch);
            let channels = map.shape[1] / anchors.len();
            for (view, values) in map.views().enumerate() {
                let per_anchor = values.chunks_exact(channels * grid.len());
                for (values, [p_w, p_h]) in per_anchor.zip(&anchors) {
                    let planes: Vec<&[f32]> = values.chunks_exact(grid.len()).collect();
                    for (index, [column, row]) in grid.cells().enumerate() {
                        let score = floor
                            .sigmoid(planes[4][index])
                            .times(floor, || floor.sigmoid(planes[person][index]));
                        finds.offer(view, score, || {
                            let [t_x, t_y, t_w, t_h] =
                                [0, 1, 2, 3].map(|plane| f64::from(planes[plane][index]));
                            let center = grid.pixels([sigmoid(t_x) + column, sigmoid(t_y) + row]);
                            corners_around(center, [p_w * t_w.exp(), p_h * t_h.exp()])
                        });
                    }
                }
            }
        }
        Ok(())
    }
}
