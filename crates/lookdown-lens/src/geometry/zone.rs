//! Zones: named areas of the frame or of the floor, and who stands in them.

use nalgebra::Point2;

use super::{
    Lens, Mount, Pixel,
    floor::{FloorPosition, pixel_of},
    polygon::Polygon,
};

/// A named area.
#[derive(Debug, Clone, PartialEq)]
pub struct Zone {
    /// Its name.
    pub name: String,
    /// Its area.
    pub area: ZoneArea,
    /// True for a bed, a sofa or a mat: people may lie there.
    pub is_lying_expected: bool,
}

/// The area of a zone.
#[derive(Debug, Clone, PartialEq)]
pub enum ZoneArea {
    /// Corner-origin frame pixels.
    Frame(Polygon),
    /// Meters, as in [`FloorPosition`].
    Floor(Polygon),
}

impl Zone {
    /// The same zone in frames `scale_x`, `scale_y` times as large; the floor stays as it is.
    pub fn scaled(&self, scale_x: f64, scale_y: f64) -> Self {
        Self {
            name: self.name.clone(),
            area: self.area.scaled(scale_x, scale_y),
            ..*self
        }
    }
}

impl ZoneArea {
    /// Returns true when a person stands in it whose foot is seen at `foot` (corner-origin frame
    /// pixels), which is `floor`. What meets no floor is in no area of it.
    pub fn holds(&self, foot: Pixel, floor: Option<FloorPosition>) -> bool {
        match self {
            Self::Frame(area) => area.holds(foot),
            Self::Floor(area) => {
                floor.is_some_and(|floor| area.holds(Point2::new(floor.x_m, floor.y_m)))
            }
        }
    }

    /// The same area in frames `scale_x`, `scale_y` times as large; the floor stays as it is.
    pub fn scaled(&self, scale_x: f64, scale_y: f64) -> Self {
        match self {
            Self::Frame(area) => Self::Frame(area.scaled(scale_x, scale_y)),
            Self::Floor(area) => Self::Floor(area.clone()),
        }
    }

    /// Points along its outline, `points_per_edge` on each edge and the first one once more at the
    /// end, corner-origin frame pixels; `None` where the lens does not see the floor. Straight
    /// edges on the floor are curves in the frame.
    pub fn outline(&self, lens: &Lens, mount: &Mount, points_per_edge: u32) -> Vec<Option<Pixel>> {
        let (Self::Frame(area) | Self::Floor(area)) = self;
        let along = area.edges().flat_map(|[a, b]| {
            let shares = (0..points_per_edge)
                .map(move |point| f64::from(point) / f64::from(points_per_edge));
            shares.map(move |share| a + (b - a) * share)
        });
        let closed = along.chain(area.corners().first().copied());
        let in_frame = closed.map(|point| match self {
            Self::Frame(_) => Some(point),
            Self::Floor(_) => {
                let (x_m, y_m) = (point.x, point.y);
                pixel_of(FloorPosition { x_m, y_m }, lens, mount)
            }
        });
        in_frame.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::floor::floor_position;

    fn camera(tilt: f64) -> (Lens, Mount) {
        let lens = Lens::equidistant_circle(299.5, 299.5, 300.0, 1.57).unwrap();
        let up = nalgebra::Unit::new_normalize(nalgebra::Vector3::new(0.0, tilt, -1.0));
        (lens, Mount::new(up, Some(3.0)))
    }

    fn square(left: f64, top: f64, side: f64) -> Polygon {
        let (right, bottom) = (left + side, top + side);
        Polygon::new(&[[left, top], [right, top], [right, bottom], [left, bottom]]).unwrap()
    }

    #[test]
    fn floor_zones_test_the_place_and_frame_zones_the_pixel() {
        let zone = |area| Zone {
            name: "door".to_owned(),
            area,
            is_lying_expected: false,
        };
        let of_frame = zone(ZoneArea::Frame(square(100.0, 100.0, 50.0)));
        let of_floor = zone(ZoneArea::Floor(square(1.0, 1.0, 1.0)));
        let (foot, place) = (Pixel::new(120.0, 120.0), |x_m| FloorPosition {
            x_m,
            y_m: 1.5,
        });
        assert!(of_frame.area.holds(foot, None));
        assert!(!of_floor.area.holds(foot, None));
        assert!(of_floor.area.holds(foot, Some(place(1.5))));
        assert!(!of_floor.area.holds(foot, Some(place(2.5))));
        // In frames of twice the size, pixels lie elsewhere, and the floor where it was.
        assert!(!of_frame.scaled(2.0, 2.0).area.holds(foot, None));
        assert!(of_frame.scaled(2.0, 2.0).area.holds(foot * 2.0, None));
        assert_eq!(of_floor.scaled(2.0, 2.0), of_floor);
    }

    #[test]
    fn outline_of_a_floor_zone_lies_where_its_floor_is_seen() {
        for tilt in [0.0, 0.3] {
            let (lens, mount) = camera(tilt);
            let zone = Zone {
                name: "door".to_owned(),
                area: ZoneArea::Floor(square(0.5, -0.5, 2.0)),
                is_lying_expected: false,
            };
            let outline = zone.area.outline(&lens, &mount, 8);
            assert_eq!(outline.len(), 33);
            assert_eq!(outline.first(), outline.last());
            for point in outline {
                let floor = floor_position(point.unwrap(), &lens, &mount).unwrap();
                let on_edge = [
                    floor.x_m - 0.5,
                    floor.x_m - 2.5,
                    floor.y_m + 0.5,
                    floor.y_m - 1.5,
                ];
                assert!(on_edge.iter().any(|off| off.abs() < 1e-6), "{floor:?}");
            }
        }
    }
}
