use lookdown_lens::geometry::PostureSigns;
use proptest::prelude::*;

use super::*;
use crate::{Tracker, test_walks::floor_tracker};

/// A thing, or a person at a desk, whose box is moved and resized by shares of its size.
fn seen([right, down]: [f64; 2], [wider, higher]: [f64; 2], score: f64) -> Observation {
    let unit = f64::sqrt(40.0 * 80.0);
    let (x, y) = (2.0 + right * unit / 100.0, 1.0 + down * unit / 100.0);
    Observation {
        size_px: [40.0 * (1.0 + wider), 80.0 * (1.0 + higher)],
        signs: PostureSigns::default(),
        ..crate::test_walks::with_score(x, y, score)
    }
}

/// A pseudorandom value from -1 to 1, the same at each run.
fn noise(step: u64, which: u64) -> f64 {
    let mixed = (step * 4 + which).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mixed = (mixed ^ (mixed >> 32)).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    let value = (mixed >> 32) as f64 / f64::from(1_u32 << 31);
    value - 1.0
}

/// A thing with the measured noise of its box.
fn thing(second: u64) -> Observation {
    let [x, y, width, height] = [0, 1, 2, 3].map(|which| 0.03 * noise(second, which));
    seen([x, y], [width, height], 0.9)
}

/// Reports of one person or thing at each of these seconds.
fn report(tracker: &mut Tracker, seconds: std::ops::Range<u64>, of: impl Fn(u64) -> Observation) {
    for second in seconds {
        let at_s = second as f64;
        tracker
            .update(f64::INFINITY, 0, at_s, &[of(second)])
            .unwrap();
    }
}

fn states(tracker: &Tracker) -> Vec<ThingState> {
    let furniture = tracker.furniture(0).unwrap();
    furniture.things().map(|thing| thing.state).collect()
}

fn persons(tracker: &Tracker) -> usize {
    tracker.tracks().filter(|track| track.counts()).count()
}

#[test]
fn a_thing_is_furniture_after_two_hours() {
    let mut tracker = floor_tracker();
    report(&mut tracker, 0..7200, thing);
    assert_eq!(
        (states(&tracker), persons(&tracker)),
        (vec![ThingState::Candidate], 1)
    );
    report(&mut tracker, 7200..7300, thing);
    assert_eq!(
        (states(&tracker), persons(&tracker)),
        (vec![ThingState::Remembered], 0)
    );
}

/// A person who types: the box sways a little, and the person changes the posture now and then.
fn typing(second: u64) -> Observation {
    let posture = second / 900;
    let lean = if second % 900 > 860 {
        0.12
    } else {
        0.02 * noise(posture, 7)
    };
    let [sway, nod, width, height] = [0, 1, 2, 3].map(|which| 0.03 * noise(second, which));
    seen([lean + sway, nod], [width, lean + height], 0.9)
}

#[test]
fn a_person_who_types_is_not_furniture() {
    let mut tracker = floor_tracker();
    report(&mut tracker, 0..36_000, typing);
    assert_eq!(
        (states(&tracker), persons(&tracker)),
        (vec![ThingState::Candidate], 1)
    );
}

#[test]
fn a_person_who_was_seen_to_arrive_is_not_furniture() {
    let mut tracker = floor_tracker();
    let walked = |second: u64| seen([9.0 - second as f64, 0.0], [0.0, 0.0], 0.9);
    report(&mut tracker, 0..9, walked);
    report(&mut tracker, 9..20_000, thing);
    assert_eq!((states(&tracker), persons(&tracker)), (vec![], 1));
}

#[test]
fn passers_by_do_not_delay_furniture() {
    let mut tracker = floor_tracker();
    // For 4 s of each 5 minutes, the box of a person hides it or merges with its own.
    let hidden = |second: u64| match (second + 200) % 300 {
        0..2 => seen([0.3, 0.0], [0.3, 0.2], 0.9),
        2..4 => seen([3.0, 0.0], [0.0, 0.0], 0.9),
        _ => thing(second),
    };
    report(&mut tracker, 0..8000, hidden);
    assert_eq!(states(&tracker)[0], ThingState::Remembered);
}

#[test]
fn a_confirmed_thing_is_furniture_at_once() {
    let mut tracker = floor_tracker();
    report(&mut tracker, 0..60, thing);
    let furniture = tracker.furniture_mut(0).unwrap();
    assert!(furniture.confirm(1) && !furniture.confirm(2));
    report(&mut tracker, 60..90, thing);
    assert_eq!(
        (states(&tracker), persons(&tracker)),
        (vec![ThingState::Confirmed], 0)
    );
}

#[test]
fn a_thing_taken_back_counts_and_is_not_learned_again() {
    let mut tracker = floor_tracker();
    report(&mut tracker, 0..7300, thing);
    assert!(tracker.furniture_mut(0).unwrap().take_back(1));
    report(&mut tracker, 7300..20_000, thing);
    assert_eq!((states(&tracker), persons(&tracker)), (vec![], 1));
    assert!(!tracker.furniture_mut(0).unwrap().take_back(1));
}

#[test]
fn a_person_in_the_place_of_furniture_counts() {
    let mut tracker = floor_tracker();
    report(&mut tracker, 0..7300, |second| Observation {
        score: 0.6,
        ..thing(second)
    });
    assert_eq!(persons(&tracker), 0);
    // The chair, and the person on it: the same place, another score.
    report(&mut tracker, 7300..7330, |second| Observation {
        score: 0.97,
        ..thing(second)
    });
    assert_eq!(persons(&tracker), 1);
}

#[test]
fn a_changed_place_is_forgotten() {
    let mut tracker = floor_tracker();
    report(&mut tracker, 0..7300, thing);
    let moved = |second: u64| seen([0.25, 0.02 * noise(second, 0)], [0.0, 0.0], 0.9);
    report(&mut tracker, 7300..10_000, moved);
    assert_eq!(persons(&tracker), 1);
    assert!(states(&tracker).contains(&ThingState::Remembered));
    report(&mut tracker, 10_000..11_000, moved);
    assert!(!states(&tracker).contains(&ThingState::Remembered));
}

#[test]
fn furniture_is_forgotten_after_a_day_without_it() {
    let mut tracker = floor_tracker();
    report(&mut tracker, 0..7300, thing);
    for (seconds, things) in [(80_000_u32, 1), (10_000, 0)] {
        let mut furniture = tracker.furniture(0).unwrap().clone();
        for _ in 0..seconds {
            furniture.update(&[], 1.0);
        }
        assert_eq!(furniture.things().count(), things);
        *tracker.furniture_mut(0).unwrap() = furniture;
    }
}

#[test]
fn things_of_a_camera_are_bounded() {
    let mut furniture = Furniture::default();
    for place in 0..200 {
        furniture.start(&seen([f64::from(place), 0.0], [0.0, 0.0], 0.9));
        furniture.update(&[], 0.1);
    }
    assert_eq!(furniture.things().count(), MAX_THINGS);
    assert_eq!(furniture.things().next().map(|thing| thing.id), Some(137));
}

#[test]
fn a_stored_memory_goes_on() {
    let mut tracker = floor_tracker();
    report(&mut tracker, 0..7000, thing);
    let stored = serde_json::to_string(&tracker).unwrap();
    let mut tracker: Tracker = serde_json::from_str(&stored).unwrap();
    report(&mut tracker, 7000..7300, thing);
    assert_eq!(states(&tracker), [ThingState::Remembered]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// True intervals with gaps, and a camera clock that jumps ahead by any time at any report.
    #[test]
    fn jumps_and_gaps_never_hasten_furniture(
        reports in prop::collection::vec(
            (prop_oneof![99 => 0.2..4.0_f64, 1 => 10.1..10_000.0_f64],
             prop_oneof![50 => Just(0.0), 50 => 0.0..4.0_f64, 1 => 0.0..1e6_f64]),
            3000,
        ),
    ) {
        let mut tracker = floor_tracker();
        let (mut at_s, mut observed_s) = (0.0, 0.0);
        for (elapsed_s, jump_s) in reports {
            at_s += elapsed_s + jump_s;
            observed_s += if elapsed_s <= LONGEST_OBSERVED_S { elapsed_s } else { 0.0 };
            tracker.update(elapsed_s, 0, at_s, &[seen([0.0, 0.0], [0.0, 0.0], 0.9)]).unwrap();
            if observed_s < FURNITURE_AFTER_S {
                prop_assert!(states(&tracker).iter().all(|state| *state == ThingState::Candidate));
            }
        }
    }
}
