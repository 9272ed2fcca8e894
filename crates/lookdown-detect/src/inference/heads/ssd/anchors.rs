//! SSD's anchors, generated from a few parameters.

use std::num::NonZeroU32;

use serde::Deserialize;

use crate::inference::heads::{
    grid::Grid,
    shape::{Batch, check_positive},
};

/// Far more than the anchors of any real model.
const MAX_ANCHORS: usize = 1 << 20;

/// The parameters of `ssd_anchor_generator` in the TensorFlow object detection API, with its
/// defaults (`multiple_grid_anchor_generator.py`, `create_ssd_anchors`).
///
/// Layer `i` of `n` has the scale `s_i = min + (max - min) i / (n - 1)`, and `s_n = 1`. An anchor
/// of scale `s` and aspect ratio `a` is `s √a` wide and `s / √a` high, in units of the view's
/// shorter side. Anchors are centred in every cell.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AnchorGenerator {
    /// Pixels per cell of each layer, finest first.
    pub strides: Vec<NonZeroU32>,
    /// Scale of the first layer.
    pub min_scale: f64,
    /// Scale of the last layer.
    pub max_scale: f64,
    /// Ratios of width to height.
    pub aspect_ratios: Vec<f64>,
    /// Restricts the first layer to three anchors: scale 0.1 at aspect 1, `s_0` at 2 and at 1/2.
    pub reduce_boxes_in_lowest_layer: bool,
    /// Aspect ratio of one more anchor per layer, with the scale `√(s_i s_(i+1))`. 0 for none.
    pub interpolated_scale_aspect_ratio: f64,
}

impl Default for AnchorGenerator {
    fn default() -> Self {
        Self {
            strides: (4..10).filter_map(|i| NonZeroU32::new(1 << i)).collect(),
            min_scale: 0.2,
            max_scale: 0.95,
            aspect_ratios: vec![1.0, 2.0, 0.5, 3.0, 0.3333],
            reduce_boxes_in_lowest_layer: true,
            interpolated_scale_aspect_ratio: 1.0,
        }
    }
}

impl AnchorGenerator {
    /// Generates the anchors `c_y, c_x, h, w`, in pixels, in the order of the network's candidates:
    /// layer by layer, row by row, cell by cell.
    pub(super) fn generate(&self, batch: &Batch) -> Result<Vec<[f64; 4]>, String> {
        check_positive("anchor_generator", &self.aspect_ratios)?;
        check_positive("anchor_generator", &[self.min_scale, self.max_scale])?;
        let shorter = f64::from(batch.width.min(batch.height));
        let mut anchors = Vec::new();
        for (layer, &stride) in self.strides.iter().enumerate() {
            let grid = Grid::of_stride(stride, batch).stretched_over(batch);
            let shapes: Vec<[f64; 2]> = self
                .layer(layer)
                .into_iter()
                .map(|(scale, aspect)| [scale / aspect.sqrt(), scale * aspect.sqrt()])
                .collect();
            if anchors.len() + grid.len().saturating_mul(shapes.len()) > MAX_ANCHORS {
                return Err(format!(
                    "`anchor_generator` in the manifest's [output] makes more than {MAX_ANCHORS} \
                     anchors; give larger `strides`"
                ));
            }
            for [column, row] in grid.cells() {
                let [c_x, c_y] = grid.pixels([column + 0.5, row + 0.5]);
                anchors.extend(
                    shapes
                        .iter()
                        .map(|[h, w]| [c_y, c_x, h * shorter, w * shorter]),
                );
            }
        }
        Ok(anchors)
    }

    /// Scale and aspect ratio of each anchor of a layer.
    fn layer(&self, layer: usize) -> Vec<(f64, f64)> {
        let scale = self.scale(layer);
        if layer == 0 && self.reduce_boxes_in_lowest_layer {
            return vec![(0.1, 1.0), (scale, 2.0), (scale, 0.5)];
        }
        let interpolated = (scale * self.scale(layer + 1)).sqrt();
        let plain = self.aspect_ratios.iter().map(|&aspect| (scale, aspect));
        plain
            .chain(
                Some((interpolated, self.interpolated_scale_aspect_ratio))
                    .filter(|&(_, a)| a > 0.0),
            )
            .collect()
    }

    fn scale(&self, layer: usize) -> f64 {
        let layers = self.strides.len();
        if layer >= layers {
            return 1.0;
        }
        let step = |i: usize| u32::try_from(i).map_or(f64::MAX, f64::from);
        self.min_scale + (self.max_scale - self.min_scale) * step(layer) / step((layers - 1).max(1))
    }
}
