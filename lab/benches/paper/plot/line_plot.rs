//! The content of a line plot.

/// Lines over the unit square.
#[derive(Debug, Clone, PartialEq)]
pub struct LinePlot {
    /// The title above the plot.
    pub title: String,
    /// The label of the horizontal axis.
    pub x_name: String,
    /// The label of the vertical axis.
    pub y_name: String,
    /// The lines, in the order of the legend.
    pub lines: Vec<Line>,
}

/// One line of the legend.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// The text in the legend.
    pub name: String,
    /// `[x, y]`, 0 to 1 each.
    pub points: Vec<[f64; 2]>,
    /// A dashed line in the same color, without its own name.
    pub dashed: Vec<[f64; 2]>,
    /// True if the points have markers.
    pub marked: bool,
}
