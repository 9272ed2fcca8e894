//! Lines that count crossings in two directions.

/// The direction of a crossing.
pub enum Direction { In, Out }

/// A line in a plane. A person who walks along it from its first point to its last has the side `in` on the right
/// (y points down in both planes, as on the screen).
pub struct Line {
    /// Its name, unique within its counter.
    pub name: String,
    /// The plane of its points.
    pub plane: Plane,
    /// Its points in order, 2 to [`MAX_POINTS`].
    pub points: Vec<[f64; 2]>,
    /// Half the width of the hysteresis band, in the unit of the plane: a crossing counts beyond it.
    pub band: f64,
}

/// A counted crossing.
pub struct Crossing { pub line: usize, pub direction: Direction, pub track: TrackId, pub at_s: f64 }

/// The state of every line over the tracks of one tracker.
pub struct LineCounter;

impl LineCounter {
    pub fn new(lines: Vec<Line>) -> Result<Self, LineError>;
    /// Returns the crossings since the last call. Call it after every [`Tracker::update`].
    pub fn update<'a>(&mut self, tracks: impl IntoIterator<Item = &'a Track>) -> Vec<Crossing>;
}
