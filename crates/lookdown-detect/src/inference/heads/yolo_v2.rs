//! `YOLOv2`.

use serde::Deserialize;

use super::{
    candidate_collector::{CandidateCollector, corners_around},
    decoder::{Decoder, Selected},
    grid::Grid,
    outputs::named_or_only,
    score::sigmoid,
    shape::{Axis, Batch, check_positive},
    tensor::{Output, TensorView},
};

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
