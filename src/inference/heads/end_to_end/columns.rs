//! The columns of a table of detections.

use serde::Deserialize;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Column {
    /// Which view of the batch, from 0.
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
    /// The class's number.
    Class,
}

/// The order taken for granted when a table has six columns.
pub(super) const SIX: [Column; 6] = [
    Column::XMin,
    Column::YMin,
    Column::XMax,
    Column::YMax,
    Column::Score,
    Column::Class,
];

/// Where in a row everything is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Places {
    pub(super) view: Option<usize>,
    pub(super) sides: [usize; 4],
    pub(super) score: usize,
    pub(super) class: usize,
}

impl Places {
    pub(super) fn of(columns: &[Column]) -> Result<Self, String> {
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
    let mut places = (0..columns.len()).filter(|&place| columns[place] == wanted);
    let first = places.next();
    match places.next() {
        None => Ok(first),
        Some(_) => Err(format!(
            "`columns` in the manifest's [output] has {name:?} twice"
        )),
    }
}
