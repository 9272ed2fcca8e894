use proptest::prelude::*;

use super::*;
use crate::test_walks::{floor_tracker, person};

const BAND: f64 = 0.3;

/// A line along y, with growing x to its left.
fn line(points: &[[f64; 2]]) -> Line {
    Line {
        name: "door".to_owned(),
        plane: Plane::FloorM,
        points: points.to_vec(),
        band: BAND,
    }
}

fn long() -> Line {
    line(&[[0.0, -1e3], [0.0, 1e3]])
}

/// The directions of the crossings of an exact path.
fn crossings(line: &Line, path: &[[f64; 2]]) -> Vec<Direction> {
    let points = (0_u32..).zip(path).map(|(at, &place)| TailPoint {
        at_s: f64::from(at),
        floor_m: Some(place),
        foot_px: [0.0, 0.0],
    });
    let points: Vec<_> = points.collect();
    let counted = Approach::default().advance(line, points.iter());
    counted
        .into_iter()
        .map(|(direction, _)| direction)
        .collect()
}

#[test]
fn a_crossing_counts_beyond_the_band() {
    let start = [[-1.0, 0.0], [-0.2, 0.0], [0.2, 0.0]];
    assert_eq!(crossings(&long(), &start), []);
    let path = [&start[..], &[[0.4, 0.0], [1.0, 0.0]]].concat();
    assert_eq!(crossings(&long(), &path), [Direction::Out]);
    let back: Vec<_> = path.iter().rev().copied().collect();
    assert_eq!(crossings(&long(), &back), [Direction::In]);
}

#[test]
fn a_step_over_the_whole_band_counts() {
    assert_eq!(
        crossings(&long(), &[[-2.0, 0.0], [2.0, 1.0]]),
        [Direction::Out]
    );
}

#[test]
fn a_track_that_begins_on_the_line_counts_nothing() {
    assert_eq!(crossings(&long(), &[[-0.1, 0.0], [1.0, 0.0]]), []);
}

#[test]
fn a_walk_around_the_end_counts_nothing() {
    let short = line(&[[0.0, 0.0], [0.0, 1.0]]);
    let around = [[-1.0, 0.5], [-0.1, 1.2], [0.1, 1.2], [1.0, 0.5]];
    assert_eq!(crossings(&short, &around), []);
    assert_eq!(
        crossings(&short, &[[-1.0, 0.5], [1.0, 0.5]]),
        [Direction::Out]
    );
    assert_eq!(crossings(&short, &[[-1.0, 1.5], [1.0, 1.5]]), []);
}

#[test]
fn a_step_through_a_corner_counts_once() {
    let bent = line(&[[0.0, -2.0], [0.0, 0.0], [0.5, 2.0]]);
    assert_eq!(
        crossings(&bent, &[[-1.0, 0.0], [1.0, 0.0]]),
        [Direction::Out]
    );
    assert_eq!(
        crossings(&bent, &[[1.0, 0.0], [-1.0, 0.0]]),
        [Direction::In]
    );
}

#[test]
fn a_tracked_walk_is_counted_once() {
    let mut tracker = floor_tracker();
    let mut counter = LineCounter::new(vec![long()], LineState::default());
    let mut found = Vec::new();
    for frame in 0..60 {
        let at_s = f64::from(frame) / 10.0;
        tracker
            .update(f64::INFINITY, 0, at_s, &[person(at_s - 3.0, 1.0)])
            .unwrap();
        found.extend(counter.update(tracker.tracks()));
    }
    assert_eq!(found.len(), 1);
    assert_eq!((found[0].line, found[0].direction), (0, Direction::Out));
}

#[test]
fn a_resumed_counter_completes_a_pending_crossing() {
    let mut tracker = floor_tracker();
    let mut counter = LineCounter::new(vec![long()], LineState::default());
    let mut sum = 0;
    for frame in 0..60 {
        let at_s = f64::from(frame) / 10.0;
        tracker
            .update(f64::INFINITY, 0, at_s, &[person(at_s - 3.0, 1.0)])
            .unwrap();
        sum += counter.update(tracker.tracks()).len();
        let text = serde_json::to_string(&counter.state).unwrap();
        let state = serde_json::from_str(&text).unwrap();
        counter = LineCounter::new(vec![long()], state);
    }
    assert_eq!(sum, 1);
}

#[test]
fn the_state_of_ended_tracks_is_dropped() {
    let mut tracker = floor_tracker();
    let mut counter = LineCounter::new(vec![long()], LineState::default());
    for frame in 0..200 {
        let persons = [person(1.0, 1.0)];
        let persons = if frame < 20 { &persons[..] } else { &[] };
        tracker
            .update(f64::INFINITY, 0, f64::from(frame) / 5.0, persons)
            .unwrap();
        counter.update(tracker.tracks());
    }
    assert!(counter.state.tracks.is_empty());
}

proptest! {
    #[test]
    fn a_person_within_the_band_is_never_counted(
        path in prop::collection::vec((-0.29..0.29_f64, -5.0..5.0_f64), 1..60),
        start in prop::sample::select(vec![-1.0, 1.0]),
    ) {
        let mut places = vec![[start, 0.0]];
        places.extend(path.iter().map(|&(x, y)| [x, y]));
        places.push([start, 0.0]);
        prop_assert_eq!(crossings(&long(), &places), []);
    }

    #[test]
    fn directions_of_one_person_alternate(
        path in prop::collection::vec((-1.0..1.0_f64, -5.0..5.0_f64), 1..60),
    ) {
        let places: Vec<_> = path.iter().map(|&(x, y)| [x, y]).collect();
        let counted = crossings(&long(), &places);
        prop_assert!(counted.windows(2).all(|pair| pair[0] != pair[1]), "{:?}", counted);
    }

    #[test]
    fn in_minus_out_is_the_change_of_the_side(
        path in prop::collection::vec((-1.0..1.0_f64, -5.0..5.0_f64), 1..60),
    ) {
        let places: Vec<_> = path.iter().map(|&(x, y)| [x, y]).collect();
        let counted = crossings(&long(), &places);
        let inside = |place: &[f64; 2]| i32::from(place[0] < 0.0);
        let settled: Vec<_> = places.iter().filter(|place| place[0].abs() >= BAND).collect();
        let change = settled.last().map_or(0, |last| inside(last) - inside(settled[0]));
        let sum: i32 = counted.iter().map(|d| if *d == Direction::In { 1 } else { -1 }).sum();
        prop_assert_eq!(sum, change);
    }
}
