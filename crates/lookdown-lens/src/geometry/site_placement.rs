//! The place of a camera on the floor of a site that several cameras share.

use super::floor::FloorPosition;

/// The place of a camera on the floor of a site.
#[derive(Debug, Clone, PartialEq)]
pub struct SitePlacement {
    /// The name of the site.
    pub site: String,
    /// The floor point below the camera, in metres of the site (x, y).
    pub position_m: [f64; 2],
    /// The angle from the x axis of the site to the x axis of the camera's floor, in degrees. It
    /// grows from x to y, so clockwise where y points down.
    pub yaw_deg: f64,
}

impl SitePlacement {
    /// Returns the place on the floor of the site, in metres (x, y).
    #[must_use]
    pub fn on_site(&self, floor: FloorPosition) -> [f64; 2] {
        let (sin, cos) = self.yaw_deg.to_radians().sin_cos();
        let [x_m, y_m] = self.position_m;
        [
            x_m + cos * floor.x_m - sin * floor.y_m,
            y_m + sin * floor.x_m + cos * floor.y_m,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_maps_x_of_the_camera_to_y_of_the_site() {
        let placement = SitePlacement {
            site: "hall".to_owned(),
            position_m: [10.0, 20.0],
            yaw_deg: 90.0,
        };
        let [x_m, y_m] = placement.on_site(FloorPosition { x_m: 2.0, y_m: 1.0 });
        assert!((x_m - 9.0).abs() < 1e-12 && (y_m - 22.0).abs() < 1e-12);
    }
}
