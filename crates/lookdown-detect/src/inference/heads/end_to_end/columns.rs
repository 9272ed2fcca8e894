//! The columns of a table of detections.

use serde::Deserialize;

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
pub(super) const SIX: [Column; 6] = [
    Column::XMin,
    Column::YMin,
    Column::XMax,
    Column::YMax,
    Column::Score,
    Column::Class,
];

/// Indices of the columns in a row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Indices {
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
