//! Zones: occupancy, entries and dwell times.

pub struct Zone { pub name: String, pub plane: Plane, pub corners: Vec<[f64; 2]> }

pub enum ZoneEvent { Entered { zone: usize, track: TrackId, at_s: f64 }, Left { zone: usize, track: TrackId, at_s: f64, dwell_s: f64 } }

pub struct ZoneCounter;

impl ZoneCounter {
    pub fn new(zones: Vec<Zone>, hold_s: f64) -> Result<Self, ZoneError>;
    /// Returns entries and exits since the last call. `ended` is what [`Tracker::update`] returned.
    pub fn update<'a>(&mut self, tracks: impl IntoIterator<Item = &'a Track>, ended: &[Track]) -> Vec<ZoneEvent>;
    /// Returns the number of persons in each zone now.
    pub fn occupancy(&self) -> Vec<usize>;
    /// Returns the dwell times so far of the persons in a zone, seconds.
    pub fn dwelling_s(&self, zone: usize, now_s: f64) -> Vec<f64>;
}
