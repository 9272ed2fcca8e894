use proptest::prelude::*;

use super::*;
use crate::test_walks::{floor_tracker, person};

fn zone() -> Zone {
    let corners = [[0.0, -2.0], [2.0, -2.0], [2.0, 2.0], [0.0, 2.0]];
    Zone {
        name: "till".to_owned(),
        plane: Plane::FloorM,
        area: Polygon::new(&corners).unwrap(),
    }
}

/// The changes of an exact path with one place per 0.2 s.
fn changes(inside: &[bool]) -> (Visit, Vec<ZoneEvent>) {
    let mut visit = Visit::default();
    let times = (0_u32..)
        .zip(inside)
        .map(|(at, inside)| (f64::from(at) / 5.0, *inside));
    let changes = times.filter_map(|(at_s, inside)| visit.see(inside, at_s));
    let changes = changes.collect();
    (visit, changes)
}

#[test]
fn a_visit_has_the_times_of_its_places() {
    let path = [vec![false; 5], vec![true; 20], vec![false; 10]].concat();
    let (_, changes) = changes(&path);
    let entered = ZoneEvent::Entered { at_s: 1.0 };
    let left = ZoneEvent::Left {
        at_s: 4.8,
        dwell_s: 4.8 - 1.0,
    };
    assert_eq!(changes, [entered, left]);
}

#[test]
fn a_trembling_track_does_not_flap() {
    let trembling: Vec<_> = (0..100).map(|place| place % 3 != 0).collect();
    let (_, outside) = changes(&trembling);
    assert_eq!(outside, []);
    let path = [vec![true; 10], trembling].concat();
    let (visit, inside) = changes(&path);
    assert_eq!(inside.len(), 1);
    assert!(visit.is_inside);
}

#[test]
fn a_track_that_ends_inside_leaves() {
    let mut tracker = floor_tracker();
    let mut counter = ZoneCounter::new(vec![zone()], ZoneState::default());
    let mut events = Vec::new();
    for frame in 0..100 {
        let at_s = f64::from(frame) / 5.0;
        let persons = [person(1.0, 1.0)];
        let persons = if frame < 20 { &persons[..] } else { &[] };
        tracker.update(f64::INFINITY, 0, at_s, persons).unwrap();
        events.extend(counter.update(tracker.tracks()));
        if frame == 19 {
            assert_eq!(counter.occupancy(), [1]);
        }
    }
    let entered = ZoneEvent::Entered { at_s: 0.0 };
    let left = ZoneEvent::Left {
        at_s: 3.8,
        dwell_s: 3.8,
    };
    assert_eq!(events, [(0, entered), (0, left)]);
    assert_eq!(counter.occupancy(), [0]);
    assert!(counter.state.tracks.is_empty());
}

#[test]
fn a_resumed_counter_keeps_its_visits() {
    let mut tracker = floor_tracker();
    let mut counter = ZoneCounter::new(vec![zone()], ZoneState::default());
    let mut events = 0;
    for frame in 0..20 {
        tracker
            .update(
                f64::INFINITY,
                0,
                f64::from(frame) / 5.0,
                &[person(1.0, 1.0)],
            )
            .unwrap();
        events += counter.update(tracker.tracks()).len();
        let text = serde_json::to_string(&counter.state).unwrap();
        let state = serde_json::from_str(&text).unwrap();
        counter = ZoneCounter::new(vec![zone()], state);
    }
    assert_eq!((events, counter.occupancy()), (1, vec![1]));
}

proptest! {
    #[test]
    fn entries_minus_exits_is_the_occupancy(path in prop::collection::vec(any::<bool>(), 0..100)) {
        let (visit, changes) = changes(&path);
        let entries = changes.iter().filter(|c| matches!(c, ZoneEvent::Entered { .. })).count();
        prop_assert_eq!(entries - (changes.len() - entries), usize::from(visit.is_inside));
        let dwells = changes.iter().filter_map(|change| match change {
            ZoneEvent::Left { dwell_s, .. } => Some(*dwell_s),
            ZoneEvent::Entered { .. } => None,
        });
        prop_assert!(dwells.into_iter().all(|dwell_s| dwell_s >= 0.0));
    }
}
