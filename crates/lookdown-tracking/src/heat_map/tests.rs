use super::*;
use crate::{CameraPose, Observation, Tracker, TrackerSettings};
use lookdown_lens::geometry::{Polygon, PostureSigns};
use nalgebra::Point2;

fn person(x: f64, y: f64) -> Observation {
    Observation {
        floor_m: Some([x, y]),
        azimuth_deg: y.atan2(x).to_degrees().rem_euclid(360.0),
        off_axis_deg: (x.hypot(y) / 2.8).atan().to_degrees(),
        center_px: [0.0, 0.0],
        size_px: [40.0, 80.0],
        signs: PostureSigns::default(),
        foot_px: [0.0, 0.0],
        score: 0.9,
        is_in_margin: false,
    }
}

#[test]
fn a_standing_person_heats_one_cell() {
    let poses = [CameraPose::alone(Some(2.8))];
    let mut tracker = Tracker::new(&poses, TrackerSettings::default()).unwrap();
    let mut heat_map = HeatMap::default();
    for frame in 0..50 {
        let at_s = 1000.0 + f64::from(frame) * 0.2;
        tracker
            .update(f64::INFINITY, 0, at_s, &[person(1.1, -0.9)])
            .unwrap();
        heat_map.update(tracker.tracks());
    }
    let cells = heat_map.take();
    let of_person = cells[&Cell { column: 4, row: -4 }];
    assert!((9_000..=10_000).contains(&of_person), "{cells:?}");
    assert_eq!(cells.values().sum::<u64>(), of_person);
    assert!(heat_map.take().is_empty());
}

#[test]
fn far_and_invalid_places_have_no_cell() {
    assert_eq!(Cell::at([-0.1, 0.3]), Some(Cell { column: -1, row: 1 }));
    assert_eq!(Cell { column: -1, row: 1 }.corner_m(), [-0.25, 0.25]);
    for x in [f64::NAN, f64::INFINITY, 1e9] {
        assert_eq!(Cell::at([x, 0.0]), None);
    }
}

fn add(presence: &mut BTreeMap<Cell, u64>, column: i16, row: i16, millis: u64) {
    presence.insert(Cell { column, row }, millis);
}

#[test]
fn area_is_the_floor_on_which_people_walked() {
    let mut presence = BTreeMap::new();
    // People walked around a square of 3 m.
    for cell in (-7..=4).step_by(2) {
        for (column, row) in [(cell, -7), (cell, 4), (-7, cell), (4, cell)] {
            add(&mut presence, column, row, 4000);
        }
    }
    // A chair beyond the wall has the most presence.
    for (column, row) in [(10, 10), (10, 11), (11, 10)] {
        add(&mut presence, column, row, 4_000_000);
    }
    assert_eq!(walked_area(&presence), None);
    for column in -6..=3 {
        for row in -6..=3 {
            add(&mut presence, column, row, 1000);
        }
    }
    let area = Polygon::new(&walked_area(&presence).unwrap()).unwrap();
    for (x, y, is_inside) in [
        (-1.6, -1.6, true),
        (1.1, 1.1, true),
        (0.0, -1.9, true),
        (0.0, -2.5, false),
        (2.6, 2.6, false),
    ] {
        assert_eq!(area.holds(Point2::new(x, y)), is_inside, "{x}, {y}");
    }
}
