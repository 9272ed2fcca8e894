//! Seconds of presence per cell of the floor.

pub struct HeatMap;

impl HeatMap {
    /// Returns an empty grid of square cells over `[x_min, y_min, x_max, y_max]` metres, at most [`MAX_CELLS`].
    pub fn new(bounds_m: [f64; 4], cell_m: f64) -> Result<Self, HeatMapError>;
    /// Adds the time since each track's last observation to the cell of its place.
    pub fn update<'a>(&mut self, tracks: impl IntoIterator<Item = &'a Track>);
    pub fn columns(&self) -> usize;
    pub fn rows(&self) -> usize;
    pub fn cell_m(&self) -> f64;
    pub fn origin_m(&self) -> [f64; 2];
    /// Returns the seconds of every cell, row by row.
    pub fn seconds(&self) -> &[f64];
    /// Adds the seconds of another grid of the same shape (for sums over days).
    pub fn add(&mut self, other: &Self) -> Result<(), HeatMapError>;
}
