//! One person of one report, as the tracker sees it.

use lookdown_lens::geometry::BoxAngles;

/// One person of one report.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Place on the floor in meters (x, y of the camera); absent without the camera's height.
    pub floor_m: Option<[f64; 2]>,
    /// Direction of the person's center: clockwise from the top of the frame, in degrees (0 to
    /// 360).
    pub azimuth_deg: f64,
    /// Angle between that direction and the optical axis, in degrees (0 to 180).
    pub off_axis_deg: f64,
    /// Center of the oriented box in frame pixels (x, y).
    pub center_px: [f64; 2],
    /// Width and height of the oriented box in frame pixels.
    pub size_px: [f64; 2],
    /// Middle of the oriented box's lower side in frame pixels (x, y): lines and zones in the frame
    /// count this point.
    pub foot_px: [f64; 2],
    /// The same box in angles, which tell the posture; absent near the rim of the lens.
    pub angles: Option<BoxAngles>,
    /// Probability that this is a person (0 to 1).
    pub score: f64,
    /// True for a person in the margin around the camera's areas, who continues tracks but does not
    /// count.
    pub is_in_margin: bool,
}
