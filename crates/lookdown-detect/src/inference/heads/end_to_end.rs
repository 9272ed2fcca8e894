//! Graphs that include suppression.

use lookdown_lens::saturating::to_usize;
use serde::Deserialize;

use super::{
    decoder::{CandidateCollector, Decoder, Selected},
    score::Activation,
    shape::{Axis, Batch, Output, TensorView, named_or_only},
};

/// Graphs that suppress overlaps: rows of final detections in `[views, rows, columns]`. If a column
/// holds the view of a row, the shape is `[…, rows, columns]` with any leading axes. Rows of
/// padding (view -1, score 0) are ignored.
///
/// The default for six columns is `x_min, y_min, x_max, y_max, score, class` (`YOLOv10`, YOLO26 and
/// exports "with NMS"). Seven columns have no common order, so they must be listed. `YOLOv7` writes
/// `view, x_min, y_min, x_max, y_max, class, score`. Caffe and `OpenVINO` write `view, class,
/// score, x_min, y_min, x_max, y_max` as shares of the view.
///
/// ```toml
/// [output]
/// head = "end_to_end"
/// person_class = 0     # COCO, 80 classes
/// columns = ["view", "x_min", "y_min", "x_max", "y_max", "class", "score"]
/// unit = "pixels"      # default; or "share" of the view's width and height
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EndToEndHead {
    /// The person's number in the class column.
    pub person_class: u16,
    /// Content of the first columns. Further columns are ignored.
    #[serde(default)]
    pub columns: Option<Vec<Column>>,
    /// Unit of box sides.
    #[serde(default)]
    pub unit: EndToEndUnit,
    /// The output to read. Default: the only one.
    #[serde(default)]
    pub name: Option<String>,
}

/// Unit of box sides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EndToEndUnit {
    /// Pixels of the network's input.
    #[default]
    Pixels,
    /// Shares of the input's width and height.
    Share,
}

impl EndToEndHead {
    /// The columns of rows of this length, or of rows of a length that is not known yet.
    fn columns(&self, length: Option<usize>) -> Option<&[Column]> {
        match (&self.columns, length) {
            (Some(columns), _) => Some(columns),
            (None, None | Some(6)) => Some(&SIX_COLUMNS),
            (None, Some(_)) => None,
        }
    }

    fn offer(
        &self,
        row: &[f32],
        indices: &Indices,
        view: usize,
        collector: &mut CandidateCollector,
    ) {
        let class = row[indices.class];
        if !class.is_finite() {
            return collector.count_non_finite();
        }
        if (class - f32::from(self.person_class)).abs() >= 0.5 {
            return;
        }
        let [width, height] = match self.unit {
            EndToEndUnit::Pixels => [1.0; 2],
            EndToEndUnit::Share => [collector.batch.width, collector.batch.height].map(f64::from),
        };
        let score = Activation::None.score(row[indices.score], collector.floor);
        collector.offer(view, score, || {
            let [x_min, y_min, x_max, y_max] = indices.sides.map(|index| f64::from(row[index]));
            [x_min * width, y_min * height, x_max * width, y_max * height]
        });
    }
}

/// The view with the number `raw`, if it is less than `views`.
fn view_number(raw: f32, views: usize) -> Option<usize> {
    (raw > -0.5)
        .then_some(to_usize(raw.round().into()))
        .filter(|&view| view < views)
}

impl Decoder for EndToEndHead {
    fn select<'o>(&self, outputs: &'o [Output<'o>], batch: &Batch) -> Selected<'o> {
        let rows = named_or_only(outputs, self.name.as_deref())?;
        let length = rows.dimensions.last().copied().flatten();
        let columns = self.columns(length).ok_or_else(|| {
            format!(
                "its output {:?} has rows of {}; list their content as `columns` in the \
                 manifest's [output]",
                rows.name,
                length.unwrap_or_default()
            )
        })?;
        let mut axes = match Indices::new(columns)?.view {
            None => vec![Axis::Views],
            Some(_) => vec![Axis::Any; rows.dimensions.len().saturating_sub(2)],
        };
        axes.extend([
            Axis::AtLeast(0, "rows"),
            Axis::AtLeast(columns.len(), "columns"),
        ]);
        batch.require(&[(rows, &axes)])?;
        Ok(vec![rows])
    }

    fn decode(&self, tensors: &[&TensorView<'_>], collector: &mut CandidateCollector) {
        let rows = tensors[0];
        let columns = rows.shape[rows.shape.len() - 1];
        let Some(Ok(indices)) = self.columns(Some(columns)).map(Indices::new) else {
            return;
        };
        let Some(index) = indices.view else {
            for (view, values) in rows.views().enumerate() {
                for row in values.chunks_exact(columns) {
                    self.offer(row, &indices, view, collector);
                }
            }
            return;
        };
        for row in rows.values.chunks_exact(columns) {
            if !row[index].is_finite() {
                collector.count_non_finite();
            } else if let Some(view) = view_number(row[index], collector.batch.views.unwrap_or(0)) {
                self.offer(row, &indices, view, collector);
            }
        }
    }
}

/// Content of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Column {
    /// Index of the view in the batch.
    View,
    /// The box's left side.
    XMin,
    /// The box's top side.
    YMin,
    /// The box's right side.
    XMax,
    /// The box's bottom side.
    YMax,
    /// The score, 0 to 1.
    Score,
    /// Number of the class.
    Class,
}

/// The default order of six columns.
const SIX_COLUMNS: [Column; 6] = [
    Column::XMin,
    Column::YMin,
    Column::XMax,
    Column::YMax,
    Column::Score,
    Column::Class,
];

/// Indices of the columns in a row.
#[derive(Debug, Clone, Copy)]
struct Indices {
    pub(super) view: Option<usize>,
    pub(super) sides: [usize; 4],
    pub(super) score: usize,
    pub(super) class: usize,
}

impl Indices {
    pub(super) fn new(columns: &[Column]) -> Result<Self, String> {
        Ok(Self {
            view: find(columns, Column::View, "view")?,
            sides: [
                need(columns, Column::XMin, "x_min")?,
                need(columns, Column::YMin, "y_min")?,
                need(columns, Column::XMax, "x_max")?,
                need(columns, Column::YMax, "y_max")?,
            ],
            score: need(columns, Column::Score, "score")?,
            class: need(columns, Column::Class, "class")?,
        })
    }
}

fn need(columns: &[Column], wanted: Column, name: &str) -> Result<usize, String> {
    find(columns, wanted, name)?
        .ok_or_else(|| format!("`columns` in the manifest's [output] lacks {name:?}"))
}

fn find(columns: &[Column], wanted: Column, name: &str) -> Result<Option<usize>, String> {
    let mut indices = (0..columns.len()).filter(|&index| columns[index] == wanted);
    let first = indices.next();
    match indices.next() {
        None => Ok(first),
        Some(_) => Err(format!(
            "`columns` in the manifest's [output] has {name:?} twice"
        )),
    }
}
