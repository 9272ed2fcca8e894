use super::*;
use crate::test_walks::{floor_tracker, person};

fn grid() -> HeatMap {
    HeatMap::new([-2.0, -2.0, 2.0, 2.0], 1.0).unwrap()
}

#[test]
fn a_person_adds_its_seconds_to_its_cell() {
    let (mut tracker, mut map) = (floor_tracker(), grid());
    for frame in 0..=50 {
        tracker
            .update(0, f64::from(frame) / 5.0, &[person(0.4, -1.4)])
            .unwrap();
        map.update(tracker.tracks());
    }
    let rows: Vec<_> = map.rows().collect();
    assert_eq!((rows.len(), map.columns(), map.cell_m()), (4, 4, 1.0));
    assert!((rows[0][2] - 10.0).abs() < 1e-9, "{rows:?}");
    assert!((rows.concat().iter().sum::<f64>() - 10.0).abs() < 1e-9);
}

#[test]
fn persons_beyond_the_grid_add_nothing() {
    let (mut tracker, mut map) = (floor_tracker(), grid());
    for frame in 0..20 {
        tracker
            .update(0, f64::from(frame) / 5.0, &[person(4.0, 0.0)])
            .unwrap();
        map.update(tracker.tracks());
    }
    assert!(map.rows().flatten().all(|&seconds| seconds == 0.0));
}

#[test]
fn grids_of_one_floor_add_up() {
    let mut sum = grid();
    let mut other = grid();
    other.seconds[3] = 2.0;
    sum.add(&other).unwrap();
    sum.add(&other).unwrap();
    assert_eq!(sum.rows().next().unwrap(), [0.0, 0.0, 0.0, 4.0]);
    let finer = HeatMap::new([-2.0, -2.0, 2.0, 2.0], 0.5).unwrap();
    assert_eq!(sum.add(&finer), Err(HeatMapError::Different));
    sum.clear();
    assert_eq!(sum, grid());
}

#[test]
fn unusable_grids_are_refused() {
    let refused = |bounds, cell| HeatMap::new(bounds, cell).unwrap_err();
    let size = |bounds_m, cell_m| HeatMapError::Size { bounds_m, cell_m };
    assert_eq!(
        refused([0.0, 0.0, 0.0, 1.0], 1.0),
        size([0.0, 0.0, 0.0, 1.0], 1.0)
    );
    assert_eq!(
        refused([0.0, 0.0, 1.0, 1.0], 0.0),
        size([0.0, 0.0, 1.0, 1.0], 0.0)
    );
    assert!(matches!(
        refused([0.0, 0.0, 1e9, 1e9], 1e-3),
        HeatMapError::Cells(_)
    ));
}
