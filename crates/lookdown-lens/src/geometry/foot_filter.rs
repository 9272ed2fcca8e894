//! Places where people count: in an area and in no ignored place. The foot decides.

mod reach;

pub use reach::AreaReach;

use super::{Pixel, floor::FloorPosition, zone::ZoneArea};

/// The width of the margin around areas on the floor, meters.
pub const MARGIN_M: f64 = 1.0;
/// The width of the margin around areas in the frame, as a share of the frame's width.
pub const MARGIN_OF_FRAME: f64 = 0.05;

/// The areas and the ignored places of a camera.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FootFilter {
    /// People count inside of these only; everywhere if there are none.
    pub areas: Vec<ZoneArea>,
    /// People do not count inside of these.
    pub ignore: Vec<ZoneArea>,
    /// The width of the margin around areas in the frame, pixels.
    pub margin_px: f64,
}

/// The place of a foot in relation to the areas and the ignored places.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FootPlace {
    /// In an area, and in no ignored place.
    Inside,
    /// Outside of all areas, but in the margin of one.
    Margin,
    /// Farther outside, or in an ignored place.
    Outside,
}

impl FootFilter {
    /// Returns true if everyone counts.
    pub fn is_empty(&self) -> bool {
        self.areas.is_empty() && self.ignore.is_empty()
    }

    /// Returns the place of a foot at `foot` (corner-origin frame pixels), which is `floor`.
    pub fn place(&self, foot: Pixel, floor: Option<FloorPosition>) -> FootPlace {
        let holds = |area: &ZoneArea| area.holds(foot, floor);
        if self.ignore.iter().any(holds) {
            FootPlace::Outside
        } else if self.areas.is_empty() || self.areas.iter().any(holds) {
            FootPlace::Inside
        } else if self.is_near(foot, floor, 1.0) {
            FootPlace::Margin
        } else {
            FootPlace::Outside
        }
    }

    /// Returns true if a foot is in an area or at most `margins` times the margin away from it.
    /// Ignored places have no effect.
    pub fn is_near(&self, foot: Pixel, floor: Option<FloorPosition>, margins: f64) -> bool {
        let is_near = |area: &ZoneArea| match area {
            ZoneArea::Frame(area) => area.holds_within(foot, margins * self.margin_px),
            ZoneArea::Floor(area) => floor.is_some_and(|FloorPosition { x_m, y_m }| {
                area.holds_within(nalgebra::Point2::new(x_m, y_m), margins * MARGIN_M)
            }),
        };
        self.areas.is_empty() || self.areas.iter().any(is_near)
    }

    /// The same places in frames `scale_x`, `scale_y` times as large.
    pub fn scaled(&self, scale_x: f64, scale_y: f64) -> Self {
        let scaled = |areas: &[ZoneArea]| {
            let areas = areas.iter().map(|area| area.scaled(scale_x, scale_y));
            areas.collect()
        };
        Self {
            areas: scaled(&self.areas),
            ignore: scaled(&self.ignore),
            margin_px: self.margin_px * scale_x,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Polygon;

    fn square(left: f64, top: f64, side: f64) -> Polygon {
        let (right, bottom) = (left + side, top + side);
        Polygon::new(&[[left, top], [right, top], [right, bottom], [left, bottom]]).unwrap()
    }

    fn at(x_m: f64, y_m: f64) -> FloorPosition {
        FloorPosition { x_m, y_m }
    }

    #[test]
    fn foot_decides_between_area_margin_and_outside() {
        let filter = FootFilter {
            areas: vec![ZoneArea::Floor(square(0.0, 0.0, 4.0))],
            ignore: vec![ZoneArea::Floor(square(1.0, 1.0, 0.5))],
            margin_px: 10.0,
        };
        let nowhere = Pixel::new(0.0, 0.0);
        for (floor, expected) in [
            (Some(at(3.0, 3.0)), FootPlace::Inside),
            (Some(at(1.2, 1.2)), FootPlace::Outside),
            (Some(at(4.9, 3.0)), FootPlace::Margin),
            (Some(at(5.1, 3.0)), FootPlace::Outside),
            (None, FootPlace::Outside),
        ] {
            assert_eq!(filter.place(nowhere, floor), expected, "{floor:?}");
        }
        assert!(filter.is_near(nowhere, Some(at(5.4, 3.0)), 1.5));
    }

    #[test]
    fn everyone_is_inside_without_areas_but_in_ignored_places() {
        let filter = FootFilter {
            ignore: vec![ZoneArea::Frame(square(100.0, 100.0, 20.0))],
            ..FootFilter::default()
        };
        let place = |x| filter.place(Pixel::new(x, 110.0), None);
        assert_eq!(place(110.0), FootPlace::Outside);
        assert_eq!(place(130.0), FootPlace::Inside);
        let doubled = filter.scaled(2.0, 2.0);
        assert_eq!(
            doubled.place(Pixel::new(220.0, 220.0), None),
            FootPlace::Outside
        );
    }

    #[test]
    fn margin_of_frame_areas_grows_with_the_frame() {
        let filter = FootFilter {
            areas: vec![ZoneArea::Frame(square(100.0, 100.0, 100.0))],
            ignore: Vec::new(),
            margin_px: 30.0,
        };
        let place = |x| filter.scaled(2.0, 2.0).place(Pixel::new(x, 300.0), None);
        assert_eq!(place(459.0), FootPlace::Margin);
        assert_eq!(place(461.0), FootPlace::Outside);
    }
}
