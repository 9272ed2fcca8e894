//! `CenterNet`.

mod extent;
mod peaks;

use serde::Deserialize;

use self::extent::Extent;
use super::{
    Decoder,
    candidate_collector::CandidateCollector,
    grid::Grid,
    outputs::named,
    score::Activation,
    shape::{Axis, Batch},
    tensor::{Output, OutputShape, TensorView},
};

pub use extent::CenternetUnit;

/// `CenterNet`: a heat map `[views, classes, rows, columns]` of object centres, and maps of the
/// same grid with the size of the object at each centre. There are two kinds of maps:
///
/// * sizes `[views, 2, …]` (width, height), with or without offsets `[views, 2, …]` of the centre
///   within its cell (x, y; half a cell without offsets)
/// * distances to the sides `[views, 4, …]` (left, top, right, bottom) from the cell's top-left
///   corner
///
/// A person is a cell whose score no neighbour of the eight exceeds. The best `max_peaks` of a view
/// are kept.
///
/// Sources: Zhou et al., "Objects as Points", 2019, sections 3 and 4; Liu et al.,
/// "Training-Time-Friendly Network", 2020, section 3 (distances to the sides).
///
/// ```toml
/// [output]
/// head = "centernet"
/// person_class = 0            # COCO, 80 classes
/// heat_map = "hm"
/// size = "wh"                 # with `offset = "reg"` if it exists; or:
/// # sides = "ltrb"
/// unit = "cells"              # default, of sizes and sides; or "pixels"
/// score_activation = "none"   # default; "sigmoid" if the heat map contains logits
/// max_peaks = 100             # default
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CenternetHead {
    /// Index of the person among the classes.
    pub person_class: u16,
    /// The output with the heat map.
    pub heat_map: String,
    /// The output with widths and heights.
    #[serde(default)]
    pub size: Option<String>,
    /// The output with centres within their cells, cells.
    #[serde(default)]
    pub offset: Option<String>,
    /// The output with distances to the sides, instead of `size` and `offset`.
    #[serde(default)]
    pub sides: Option<String>,
    /// Unit of sizes and sides.
    #[serde(default)]
    pub unit: CenternetUnit,
    /// Activation applied to the heat map.
    #[serde(default)]
    pub score_activation: Activation,
    /// Largest number of persons in a view.
    #[serde(default = "default_max_peaks")]
    pub max_peaks: usize,
}

fn default_max_peaks() -> usize {
    100
}

impl CenternetHead {
    fn select<'o, T: Output>(
        &self,
        outputs: &'o [T],
        batch: &Batch,
    ) -> Result<(&'o T, Extent<'o, T>), String> {
        let [rows, columns] = Grid::axes(batch);
        let map = |channels: Axis| [Axis::Views, channels, rows, columns];
        let classes = Axis::AtLeast(usize::from(self.person_class) + 1, "classes");
        let (two, four) = (map(Axis::Exactly(2)), map(Axis::Exactly(4)));
        let heat = named(outputs, &self.heat_map)?;
        let mut wanted = vec![(heat, map(classes))];
        let extent = match (&self.size, &self.offset, &self.sides) {
            (Some(size), offset, None) => {
                let size = named(outputs, size)?;
                let offset = offset.as_deref().map(|name| named(outputs, name));
                let offset = offset.transpose()?;
                wanted.push((size, two));
                wanted.extend(offset.map(|offset| (offset, two)));
                Extent::Size(size, offset)
            }
            (None, None, Some(sides)) => {
                let sides = named(outputs, sides)?;
                wanted.push((sides, four));
                Extent::Sides(sides)
            }
            _ => {
                return Err(
                    "the manifest's [output] needs either `size` (and `offset`) or \
                            `sides`: the outputs that hold them"
                        .to_owned(),
                );
            }
        };
        let wanted: Vec<_> = wanted.iter().map(|(map, axes)| (*map, &axes[..])).collect();
        batch.require(&wanted)?;
        Ok((heat, extent))
    }
}

impl Decoder for CenternetHead {
    fn check(&self, outputs: &[OutputShape<'_>], batch: &Batch) -> Result<(), String> {
        self.select(outputs, batch).map(drop)
    }

    fn decode(
        &self,
        outputs: &[TensorView<'_>],
        batch: &Batch,
        finds: &mut CandidateCollector,
    ) -> Result<(), String> {
        let (heat, extent) = self.select(outputs, batch)?;
        let grid = Grid::of_map(heat, batch);
        let person = usize::from(self.person_class);
        for (view, classes) in heat.views().enumerate() {
            let plane = &classes[person * grid.len()..][..grid.len()];
            let mut best = Vec::new();
            for (index, &raw) in plane.iter().enumerate() {
                let score = self.score_activation.score(raw, finds.floor);
                if let Some(score) = finds.judge(score)
                    && peaks::is_peak(plane, heat.shape[3], index)
                {
                    best.push((score, index));
                }
            }
            peaks::keep_best(&mut best, self.max_peaks);
            for (score, index) in best {
                finds.add(view, score, extent.corners(view, index, grid, self.unit));
            }
        }
        Ok(())
    }
}
