//! Tracks of anonymous persons from the reports of one camera, or of all cameras of a site.

/// Identifies a track within its tracker; never used twice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct TrackId(pub u64);

/// The plane in which lines, zones and tracks are given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Plane {
    /// Floor metres: those of the site, or of the camera alone.
    FloorM,
    /// Corner-origin pixels of the frame. Only for a camera that has its tracker to itself.
    FramePx,
}

/// A confirmed or possible person over time.
pub struct Track;

impl Track {
    /// Returns the track's identifier.
    pub fn id(&self) -> TrackId;
    /// Returns the time of the last observation, seconds since the Unix epoch.
    pub fn seen_at_s(&self) -> f64;
    /// Returns the time of the first observation, seconds since the Unix epoch.
    pub fn first_seen_at_s(&self) -> f64;
    /// Returns the filtered place at the last observation in `plane`; `None` where the tracker has no such plane.
    pub fn place(&self, plane: Plane) -> Option<[f64; 2]>;
    /// Returns the velocity in the plane of the floor, metres per second; `None` without the camera's height.
    pub fn velocity_m_s(&self) -> Option<[f64; 2]>;
    /// Returns the last places at observations, oldest first, at most [`TAIL_POINTS`].
    pub fn tail(&self) -> impl Iterator<Item = TailPoint>;
}

/// A tracker of one camera or one site. Serializable: stored with the counts, it survives a restart.
pub struct Tracker;

impl Tracker {
    /// Returns a tracker for `cameras`: on the floor where every camera has its height, else in bearing space.
    ///
    /// # Errors
    /// [`SiteError`] without cameras, with more than [`MAX_CAMERAS`], or with several of which one lacks its height.
    pub fn new(cameras: Vec<CameraPose>, settings: TrackerSettings) -> Result<Self, SiteError>;

    /// Updates the tracks with the persons of one frame of the camera number `camera` (index into `cameras`), captured at
    /// `at_s` (seconds since the Unix epoch). Returns the confirmed tracks that ended.
    ///
    /// Reports of several cameras may arrive in any order up to [`TrackerSettings::max_lateness_s`]; those of one camera
    /// are in order of time.
    ///
    /// # Errors
    /// [`RefusedReport`] for an unknown camera, a time that is not finite, or a report that is too old. Nothing changes then.
    pub fn update(&mut self, camera: usize, at_s: f64, persons: &[Observation]) -> Result<Vec<Track>, RefusedReport>;

    /// Returns the confirmed tracks in order of their identifiers.
    pub fn tracks(&self) -> impl Iterator<Item = &Track>;
}
