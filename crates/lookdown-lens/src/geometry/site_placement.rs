//! The place of a camera on the floor of a site that several cameras share.

/// The place of a camera on the floor of a site.
#[derive(Debug, Clone, PartialEq)]
pub struct SitePlacement {
    /// The name of the site.
    pub site: String,
    /// The floor point below the camera, in meters of the site (x, y).
    pub position_m: [f64; 2],
    /// The angle from the x axis of the site to the x axis of the camera's floor, in degrees. It
    /// grows from x to y, so clockwise where y points down.
    pub yaw_deg: f64,
}
