//! The parts of a frame that can show a person who stands in an area.
//!
//! A pixel may show a person of any height up to [`TALLEST_M`]. In units of the camera's height,
//! the ray at the angle `theta` from straight down meets the floor at `tan(theta)`, and a height
//! `q` above the floor at `(1 - q) tan(theta)`. The pixel matters if the floor between the two, in
//! that direction, is near an area.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Point2, Vector2};

use super::{FootFilter, MARGIN_M};
use crate::geometry::{
    Lens, Mount, Pixel, Ray,
    pixels::{to_corner_origin, to_pixel_center},
    zone::ZoneArea,
};
use crate::saturating::to_u32;

/// Tallest person, meters.
const TALLEST_M: f64 = 2.1;
/// The distance from an area at which people are still looked for, in margins: the margin itself,
/// half a body, and the error of a foot.
const REACH_MARGINS: f64 = 1.6;
/// Error of the mount and of the lens, radians.
const ANGLE_ERROR: f64 = 3.0 * std::f64::consts::PI / 180.0;
/// Flattest angle from straight down of a place on the floor, radians.
const FLATTEST: f64 = FRAC_PI_2 - 0.035;
/// Cells along each side of the frame.
const CELLS: u32 = 64;
/// Steps along the floor that a ray passes.
const STEPS: u32 = 24;

/// The cells of a frame that can show a person who stands in an area or in its margin.
#[derive(Debug, Clone, PartialEq)]
pub struct AreaReach {
    /// Row by row; true where a person can be visible.
    cells: Vec<bool>,
    cell_width: f64,
    cell_height: f64,
}

impl AreaReach {
    /// Returns the reach of the areas in frames of `width` × `height` pixels; `None` without areas.
    pub fn new(
        filter: &FootFilter,
        lens: &Lens,
        mount: &Mount,
        width: u32,
        height: u32,
    ) -> Option<Self> {
        if filter.areas.is_empty() {
            return None;
        }
        let (cell_width, cell_height) = (cell_side(width), cell_side(height));
        let side = CELLS + 1;
        let nodes: Vec<bool> = (0..side * side)
            .map(|node| {
                let [column, row] = [node % side, node / side].map(f64::from);
                may_show(
                    filter,
                    Pixel::new(column * cell_width, row * cell_height),
                    lens,
                    mount,
                )
            })
            .collect();
        // A cell counts if a node of it or of a neighboring cell does.
        let around = |at: u32| at.saturating_sub(1)..=(at + 2).min(CELLS);
        let cells = (0..CELLS * CELLS).map(|cell| {
            let (column, row) = (cell % CELLS, cell / CELLS);
            let mut rows = around(row);
            rows.any(|row| around(column).any(|column| nodes[(row * side + column) as usize]))
        });
        Some(Self {
            cells: cells.collect(),
            cell_width,
            cell_height,
        })
    }

    /// Returns true if a position of the frame (corner-origin pixels) can show a person of the
    /// areas.
    pub fn holds(&self, at: Pixel) -> bool {
        let cell = cell(at.y, self.cell_height) * CELLS + cell(at.x, self.cell_width);
        self.cells[cell as usize]
    }

    /// Returns boxes (corner-origin pixels) that cover all positions out of reach.
    pub fn boxes_outside(&self) -> Vec<[f64; 4]> {
        let rows = (0_u32..).zip(self.cells.chunks_exact(CELLS as usize));
        let boxes = rows.flat_map(|(row, cells)| {
            let [top, bottom] = [row, row + 1].map(|row| f64::from(row) * self.cell_height);
            runs_outside(cells).into_iter().map(move |columns| {
                let [left, right] = columns.map(|column| f64::from(column) * self.cell_width);
                [left, top, right, bottom]
            })
        });
        boxes.collect()
    }

    /// Memory held, bytes.
    pub fn bytes(&self) -> usize {
        self.cells.len()
    }
}

/// The first and last columns, exclusively, of the runs of cells out of reach.
fn runs_outside(cells: &[bool]) -> Vec<[u32; 2]> {
    let mut runs: Vec<[u32; 2]> = Vec::new();
    for (column, _) in (0_u32..).zip(cells).filter(|(_, holds)| !**holds) {
        match runs.last_mut() {
            Some([_, end]) if *end == column => *end += 1,
            _ => runs.push([column, column + 1]),
        }
    }
    runs
}

fn cell_side(side: u32) -> f64 {
    f64::from(side.max(1)) / f64::from(CELLS)
}

fn cell(position: f64, side: f64) -> u32 {
    to_u32(position / side).min(CELLS - 1)
}

/// Returns true if a position of the frame can show a person who stands near an area.
fn may_show(filter: &FootFilter, at: Pixel, lens: &Lens, mount: &Mount) -> bool {
    let Some(ray) = lens.unproject(&to_pixel_center(at)) else {
        return false;
    };
    let levelled = mount.camera_from_floor().inverse_transform_vector(&ray);
    let outward = levelled.xy();
    let theta = outward.norm().atan2(levelled.z);
    let direction = outward
        .try_normalize(f64::EPSILON)
        .unwrap_or_else(Vector2::x);
    let tallest = mount
        .height_m()
        .map_or(1.0, |height_m| TALLEST_M / height_m);
    let nearest = (theta - ANGLE_ERROR).clamp(0.0, FLATTEST).tan() * (1.0 - tallest).max(0.0);
    let [from, to] = [nearest.atan(), (theta + ANGLE_ERROR).min(FLATTEST)];
    (0..=STEPS).any(|step| {
        let angle = from + (to - from) * f64::from(step) / f64::from(STEPS);
        let place = direction * angle.tan();
        // Steps are finer than the reach but for the far end, where they are a few meters wide.
        let step_length = (to - from) / f64::from(STEPS) / angle.cos().powi(2);
        let is_near = |area: &ZoneArea| is_near(filter, area, place, step_length, lens, mount);
        filter.areas.iter().any(is_near)
    })
}

/// Returns true if a place on the floor, in heights of the camera, is near an area.
fn is_near(
    filter: &FootFilter,
    area: &ZoneArea,
    place: Vector2<f64>,
    step_length: f64,
    lens: &Lens,
    mount: &Mount,
) -> bool {
    match (area, mount.height_m()) {
        (ZoneArea::Floor(area), Some(height_m)) => {
            let reach = REACH_MARGINS * MARGIN_M + step_length * height_m;
            area.holds_within(Point2::from(place * height_m), reach)
        }
        // Without the height, nothing is known of a place on the floor.
        (ZoneArea::Floor(_), None) => true,
        (ZoneArea::Frame(area), _) => {
            let ray = mount.camera_from_floor() * Ray::new(place.x, place.y, 1.0);
            let pixel = lens.project(&ray).or_else(|| lens.project_to_rim(&ray));
            pixel.is_some_and(|pixel| {
                let pixel = to_corner_origin(pixel);
                area.holds_within(pixel, REACH_MARGINS * filter.margin_px)
            })
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::{Polygon, floor::FloorPosition};

    fn camera(height_m: Option<f64>) -> (Lens, Mount) {
        let lens = Lens::equidistant_circle(299.5, 299.5, 300.0, 1.57).unwrap();
        let up = nalgebra::Unit::new_normalize(nalgebra::Vector3::new(0.05, -0.1, -1.0));
        (lens, Mount::new(up, height_m))
    }

    fn room(areas: Vec<ZoneArea>) -> FootFilter {
        FootFilter {
            areas,
            ignore: Vec::new(),
            margin_px: 30.0,
        }
    }

    /// 2 m × 3 m of floor, to the right of the camera.
    fn floor_area() -> Polygon {
        Polygon::new(&[[1.0, -1.0], [3.0, -1.0], [3.0, 2.0], [1.0, 2.0]]).unwrap()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]
        #[test]
        fn every_part_of_a_person_of_the_area_is_in_reach(
            x_m in 1.0..3.0_f64, y_m in -1.0..2.0_f64, height_m in 0.0..2.1_f64,
            camera_m in 2.2..6.0_f64,
        ) {
            let (lens, mount) = camera(Some(camera_m));
            let frame = floor_area();
            let corners = frame.corners().iter().map(|at| {
                let place = FloorPosition { x_m: at.x, y_m: at.y };
                let at = crate::geometry::floor::pixel_of(place, &lens, &mount).unwrap();
                [at.x, at.y]
            });
            let in_frame = Polygon::new(&corners.collect::<Vec<_>>()).unwrap();
            let part = Ray::new(x_m, y_m, camera_m - height_m);
            let part = lens.project(&(mount.camera_from_floor() * part));
            for (area, mount) in [
                (ZoneArea::Floor(floor_area()), mount),
                (ZoneArea::Frame(in_frame.clone()), mount),
                (ZoneArea::Frame(in_frame), camera(None).1),
            ] {
                let reach = AreaReach::new(&room(vec![area]), &lens, &mount, 600, 600).unwrap();
                if let Some(part) = part {
                    let at = to_corner_origin(part);
                    prop_assert!(reach.holds(at), "{at}");
                }
            }
        }
    }

    #[test]
    fn other_side_of_the_camera_is_out_of_reach() {
        let (lens, mount) = camera(Some(3.0));
        let filter = room(vec![ZoneArea::Floor(floor_area())]);
        let reach = AreaReach::new(&filter, &lens, &mount, 600, 600).unwrap();
        assert!(!reach.holds(Pixel::new(80.0, 300.0)));
        assert!(reach.holds(Pixel::new(450.0, 320.0)));
        let share = reach.cells.iter().filter(|holds| **holds).count() * 100 / reach.cells.len();
        assert!((20..65).contains(&share), "{share} %");
        let outside = reach.boxes_outside();
        for (x, y) in [(80.0, 300.0), (450.0, 320.0), (300.0, 20.0), (550.0, 550.0)] {
            let is_outside = |&[left, top, right, bottom]: &[f64; 4]| {
                left <= x && x < right && top <= y && y < bottom
            };
            let is_outside = outside.iter().any(is_outside);
            assert_eq!(is_outside, !reach.holds(Pixel::new(x, y)), "{x}, {y}");
        }
        assert!(AreaReach::new(&FootFilter::default(), &lens, &mount, 600, 600).is_none());
    }
}
