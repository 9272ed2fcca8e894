//! Tests of the tracker as a whole.

use lookdown_lens::geometry::{FloorVotes, Posture};
use proptest::prelude::*;

use super::*;
use crate::{
    CameraPose, Observation,
    test_walks::{CAMERA_M, floor_tracker, person, with_score},
};

fn ids(tracker: &Tracker) -> Vec<u64> {
    tracker.tracks().map(|track| track.id.0).collect()
}

fn floor_of(track: &Track) -> [f64; 2] {
    track.place(Plane::FloorM).unwrap()
}

/// Frames of a walk at 5 per second from x = -3 m on with 1 m/s.
fn walk(tracker: &mut Tracker, frames: std::ops::Range<u32>, seen: impl Fn(u32) -> bool) {
    for frame in frames {
        let at_s = f64::from(frame) / 5.0;
        let persons = [person(at_s - 3.0, 1.0)];
        let persons = if seen(frame) { &persons[..] } else { &[] };
        tracker.update(f64::INFINITY, 0, at_s, persons).unwrap();
    }
}

#[test]
fn one_walk_is_one_track() {
    let mut tracker = floor_tracker();
    walk(&mut tracker, 0..30, |_| true);
    assert_eq!(ids(&tracker), [1]);
    let track = tracker.tracks().next().unwrap();
    let [vx, vy] = track.velocity_m_s().unwrap();
    assert!((vx - 1.0).abs() < 0.1 && vy.abs() < 0.1, "{vx} {vy}");
    assert_eq!(track.last_person.person, 0);
}

#[test]
fn a_track_survives_a_second_without_its_person() {
    let mut tracker = floor_tracker();
    walk(&mut tracker, 0..30, |frame| !(12..17).contains(&frame));
    assert_eq!(ids(&tracker), [1]);
}

#[test]
fn person_who_sits_keeps_the_track_after_a_minute() {
    for (x, id) in [(2.2, 1), (-3.0, 2)] {
        let mut tracker = floor_tracker();
        for second in 0..80 {
            let place = if second < 10 { 2.0 } else { x };
            let persons = [person(place, 1.0)];
            let is_missed = (10..70).contains(&second);
            let shown = if is_missed { &[] } else { &persons[..] };
            tracker
                .update(f64::INFINITY, 0, f64::from(second), shown)
                .unwrap();
        }
        assert_eq!(ids(&tracker), [id], "{x}");
    }
}

#[test]
fn a_track_ends_when_its_person_is_gone() {
    let mut tracker = floor_tracker();
    walk(&mut tracker, 0..10, |_| true);
    let mut ended = Vec::new();
    for frame in 10..40 {
        ended.extend(
            tracker
                .update(f64::INFINITY, 0, f64::from(frame) / 5.0, &[])
                .unwrap(),
        );
    }
    assert_eq!(ended.len(), 1);
    assert_eq!(ended[0].seen_s, 9.0 / 5.0);
    assert_eq!(ids(&tracker), [0; 0]);
}

#[test]
fn a_single_detection_confirms_no_track() {
    let mut tracker = floor_tracker();
    tracker
        .update(f64::INFINITY, 0, 0.0, &[person(1.0, 1.0)])
        .unwrap();
    assert_eq!(ids(&tracker), [0; 0]);
}

#[test]
fn slow_reports_show_who_comes_and_goes_at_once() {
    let mut tracker = floor_tracker();
    let mut shown = Vec::new();
    for report in 0..7 {
        let is_there = (2..4).contains(&report);
        let person = [with_score(1.0, 1.0, 0.97)];
        let persons = if is_there { &person[..] } else { &[] };
        let at_s = f64::from(report) * 1.5;
        tracker.update(f64::INFINITY, 0, at_s, persons).unwrap();
        shown.push(tracker.tracks().count());
    }
    assert_eq!(shown, [0, 0, 1, 1, 1, 0, 0]);
}

#[test]
fn low_scores_continue_tracks_but_start_none() {
    let mut tracker = floor_tracker();
    let low = |at_s: f64| with_score(at_s - 3.0, 1.0, 0.2);
    for frame in 0..20 {
        let at_s = f64::from(frame) / 5.0;
        tracker
            .update(f64::INFINITY, 0, at_s, &[low(at_s)])
            .unwrap();
    }
    assert_eq!(ids(&tracker), [0; 0]);
    let mut tracker = floor_tracker();
    walk(&mut tracker, 0..10, |_| true);
    for frame in 10..15 {
        let at_s = f64::from(frame) / 5.0;
        tracker
            .update(f64::INFINITY, 0, at_s, &[low(at_s)])
            .unwrap();
    }
    assert_eq!(tracker.tracks().next().unwrap().seen_s, 14.0 / 5.0);
}

#[test]
fn a_weak_thing_that_stands_still_is_no_person() {
    let mut tracker = floor_tracker();
    let mut ended = Vec::new();
    for frame in 0..300 {
        let at_s = f64::from(frame) / 5.0;
        // A poster, now and then as clear as a person.
        let poster = with_score(2.0, 2.0, if frame % 10 == 0 { 0.6 } else { 0.3 });
        ended.extend(tracker.update(f64::INFINITY, 0, at_s, &[poster]).unwrap());
        assert_eq!(ids(&tracker), [0; 0], "{at_s}");
    }
    assert_eq!(ended, []);
}

#[test]
fn a_weak_person_who_walks_is_one() {
    let mut tracker = floor_tracker();
    for frame in 0..30 {
        let at_s = f64::from(frame) / 5.0;
        let person = with_score(at_s - 3.0, 1.0, 0.36);
        tracker.update(f64::INFINITY, 0, at_s, &[person]).unwrap();
    }
    assert_eq!(ids(&tracker), [1]);
}

#[test]
fn a_track_that_stays_on_a_weak_thing_ends() {
    let mut tracker = floor_tracker();
    walk(&mut tracker, 0..15, |_| true);
    assert_eq!(ids(&tracker), [1]);
    let mut ended = Vec::new();
    for frame in 15..150 {
        let at_s = f64::from(frame) / 5.0;
        let poster = with_score(-0.2, 1.0, 0.2);
        ended.extend(tracker.update(f64::INFINITY, 0, at_s, &[poster]).unwrap());
    }
    assert_eq!(ended.len(), 1);
    assert_eq!(ids(&tracker), [0; 0]);
}

#[test]
fn persons_who_pass_each_other_keep_their_tracks() {
    let mut tracker = floor_tracker();
    for frame in 0..30 {
        let at_s = f64::from(frame) / 5.0;
        let persons = [person(at_s - 3.0, 0.4), person(3.0 - at_s, -0.4)];
        tracker.update(f64::INFINITY, 0, at_s, &persons).unwrap();
    }
    let places: Vec<_> = tracker.tracks().map(floor_of).collect();
    assert_eq!(places.len(), 2);
    assert!(places[0][0] > 2.0 && places[1][0] < -2.0, "{places:?}");
}

#[test]
fn without_a_height_persons_are_tracked_by_bearing() {
    let alone = CameraPose::alone(None);
    let mut tracker = Tracker::new(&[alone], TrackerSettings::default()).unwrap();
    // Straight below the camera, where the azimuth jumps by half a turn.
    for frame in 0..30 {
        let at_s = f64::from(frame) / 5.0;
        tracker
            .update(f64::INFINITY, 0, at_s, &[person(at_s - 3.0, 0.01)])
            .unwrap();
    }
    assert_eq!(ids(&tracker), [1]);
    let track = tracker.tracks().next().unwrap();
    assert_eq!(track.place(Plane::FloorM), None);
    let direction = track.motion.direction().unwrap();
    let azimuth = direction.y.atan2(direction.x).to_degrees();
    let off_axis = direction.xy().norm().atan2(direction.z).to_degrees();
    assert!((azimuth - 90.0).abs() < 1.0, "{azimuth}");
    assert!(
        (off_axis - (2.8_f64 / CAMERA_M).atan().to_degrees()).abs() < 3.0,
        "{off_axis}"
    );
}

#[test]
fn refused_reports_change_nothing() {
    let mut tracker = floor_tracker();
    walk(&mut tracker, 0..10, |_| true);
    let before = tracker.clone();
    let persons = [person(0.0, 0.0)];
    let refused = |tracker: &mut Tracker, camera, at_s| {
        tracker
            .update(f64::INFINITY, camera, at_s, &persons)
            .unwrap_err()
    };
    assert_eq!(
        refused(&mut tracker, 1, 9.0),
        RefusedReport::UnknownCamera(1)
    );
    assert_eq!(refused(&mut tracker, 0, f64::NAN), RefusedReport::Time);
    assert_eq!(refused(&mut tracker, 0, 1.8), RefusedReport::OutOfOrder);
    assert_eq!(tracker, before);
}

#[test]
fn persons_without_finite_numbers_are_ignored() {
    let mut tracker = floor_tracker();
    for frame in 0..10 {
        let persons = [
            person(f64::NAN, 0.0),
            person(f64::INFINITY, 0.0),
            with_score(0.0, 0.0, f64::NAN),
            Observation {
                floor_m: None,
                ..person(0.0, 0.0)
            },
        ];
        tracker
            .update(f64::INFINITY, 0, f64::from(frame), &persons)
            .unwrap();
    }
    assert_eq!(ids(&tracker), [0; 0]);
}

#[test]
fn a_stored_tracker_goes_on_as_if_never_stopped() {
    let mut tracker = floor_tracker();
    walk(&mut tracker, 0..10, |_| true);
    let text = serde_json::to_string(&tracker).unwrap();
    let mut restored: Tracker = serde_json::from_str(&text).unwrap();
    walk(&mut tracker, 10..20, |_| true);
    walk(&mut restored, 10..20, |_| true);
    let last = |tracker: &Tracker| {
        let track = tracker.tracks().next().unwrap();
        (
            track.id,
            track.tail().len(),
            floor_of(track).map(|m| (m * 1e9).round()),
        )
    };
    assert_eq!(last(&restored), last(&tracker));
    let unused: Tracker =
        serde_json::from_str(&serde_json::to_string(&floor_tracker()).unwrap()).unwrap();
    assert_eq!(unused, floor_tracker());
}

#[test]
fn cameras_of_a_site_need_their_heights() {
    let poses = [CameraPose::alone(Some(3.0)), CameraPose::alone(None)];
    let refused =
        |poses: &[CameraPose]| Tracker::new(poses, TrackerSettings::default()).unwrap_err();
    assert_eq!(refused(&poses), SiteError::NoHeight(1));
    assert_eq!(refused(&[]), SiteError::Count(0));
    assert_eq!(
        refused(&[poses[0]; MAX_CAMERAS + 1]),
        SiteError::Count(MAX_CAMERAS + 1)
    );
}

/// Two cameras 4 m apart, the second one turned by a quarter.
fn site() -> (Tracker, [CameraPose; 2]) {
    let pose = |x, yaw_deg| CameraPose {
        position_m: [x, 0.0],
        yaw_deg,
        height_m: Some(CAMERA_M),
    };
    let poses = [pose(-2.0, 0.0), pose(2.0, 90.0)];
    let mut settings = TrackerSettings::default();
    settings.noise.foot_offset_m = 0.0;
    (Tracker::new(&poses, settings).unwrap(), poses)
}

/// A person at a place of the site as a camera sees it.
fn seen_by(pose: &CameraPose, [x, y]: [f64; 2]) -> Observation {
    let (sin, cos) = pose.yaw_deg.to_radians().sin_cos();
    let [x, y] = [x - pose.position_m[0], y - pose.position_m[1]];
    person(cos * x + sin * y, cos * y - sin * x)
}

#[test]
fn a_person_under_two_cameras_is_one_track() {
    let (mut tracker, poses) = site();
    for frame in 0..40 {
        let camera = frame % 2;
        let at_s = f64::from(u32::try_from(frame).unwrap()) / 10.0;
        let place = [at_s - 2.0, 0.5];
        tracker
            .update(
                f64::INFINITY,
                camera,
                at_s,
                &[seen_by(&poses[camera], place)],
            )
            .unwrap();
    }
    assert_eq!(ids(&tracker), [1]);
    let [x, y] = floor_of(tracker.tracks().next().unwrap());
    assert!((x - 1.9).abs() < 0.2 && (y - 0.5).abs() < 0.2, "{x} {y}");
}

#[test]
fn a_second_camera_tells_more_about_the_posture_than_the_same() {
    let (_, poses) = site();
    let votes = FloorVotes {
        lying: 0.45,
        low: 0.3,
    };
    let [alone, together] = [0, 1].map(|other| {
        let (mut tracker, _) = site();
        for (frame, camera) in [0, other, 0, other].into_iter().enumerate() {
            let mut seen = seen_by(&poses[camera], [0.0, 0.5]);
            seen.signs.votes = Some(votes);
            let at_s = f64::from(u32::try_from(frame).unwrap()) / 20.0;
            tracker
                .update(f64::INFINITY, camera, at_s, &[seen])
                .unwrap();
        }
        let track = tracker.tracks().next().unwrap();
        track.posture_belief().probability(Posture::Lying)
    });
    assert!(together > alone + 0.05, "{alone} {together}");
}

#[test]
fn cameras_that_place_a_person_apart_make_one_track() {
    let (mut tracker, poses) = site();
    for frame in 0..40 {
        let camera = frame % 2;
        let at_s = f64::from(u32::try_from(frame).unwrap()) / 5.0;
        let place = if camera == 0 { [0.0, 0.0] } else { [-1.0, 0.0] };
        tracker
            .update(
                f64::INFINITY,
                camera,
                at_s,
                &[seen_by(&poses[camera], place)],
            )
            .unwrap();
        assert!(ids(&tracker).iter().all(|&id| id == 1), "{frame}");
    }
    assert_eq!(ids(&tracker), [1]);
}

#[test]
fn a_confirmed_track_ends_after_max_unseen_s() {
    let settings = TrackerSettings {
        max_unseen_s: 6.0,
        ..TrackerSettings::default()
    };
    let mut tracker = Tracker::new(&[CameraPose::alone(Some(CAMERA_M))], settings).unwrap();
    for frame in 0..50 {
        let at_s = f64::from(frame) / 5.0;
        let persons = [person(1.0, 1.0)];
        let shown = if at_s <= 2.0 { &persons[..] } else { &[] };
        tracker.update(f64::INFINITY, 0, at_s, shown).unwrap();
        let remains = (0.5..=8.0).contains(&at_s);
        assert!(ids(&tracker).is_empty() != remains || at_s < 0.5, "{at_s}");
    }
}

#[test]
fn reports_of_another_camera_may_be_late() {
    let (mut tracker, poses) = site();
    for frame in 0..20 {
        let at_s = f64::from(frame) / 5.0;
        let place = |at_s: f64| [at_s - 2.0, 0.5];
        tracker
            .update(f64::INFINITY, 0, at_s, &[seen_by(&poses[0], place(at_s))])
            .unwrap();
        let late_s = at_s - 0.7;
        tracker
            .update(
                f64::INFINITY,
                1,
                late_s,
                &[seen_by(&poses[1], place(late_s))],
            )
            .unwrap();
    }
    assert_eq!(ids(&tracker), [1]);
    let [x, _] = floor_of(tracker.tracks().next().unwrap());
    assert!((x - 1.8).abs() < 0.2, "{x}");
    assert_eq!(
        tracker.update(f64::INFINITY, 1, 0.9, &[]),
        Err(RefusedReport::OutOfOrder)
    );
    let (mut tracker, _) = site();
    tracker.update(f64::INFINITY, 0, 100.0, &[]).unwrap();
    assert_eq!(
        tracker.update(f64::INFINITY, 1, 50.0, &[]),
        Err(RefusedReport::Late(50.0))
    );
}

#[test]
fn only_tracks_in_sight_of_a_camera_are_missed() {
    let pose = |x| CameraPose {
        position_m: [x, 0.0],
        yaw_deg: 0.0,
        height_m: Some(CAMERA_M),
    };
    let poses = [pose(0.0), pose(100.0)];
    let mut tracker = Tracker::new(&poses, TrackerSettings::default()).unwrap();
    for frame in 0..10 {
        tracker
            .update(
                f64::INFINITY,
                0,
                f64::from(frame) / 5.0,
                &[person(1.0, 1.0)],
            )
            .unwrap();
    }
    // The first camera stalls; the other one reports an empty floor far away.
    for frame in 10..40 {
        tracker
            .update(f64::INFINITY, 1, f64::from(frame) / 5.0, &[])
            .unwrap();
    }
    assert_eq!(ids(&tracker), [1]);
}

#[test]
fn tracks_and_their_histories_are_bounded() {
    let settings = TrackerSettings {
        max_tracks: 20,
        ..TrackerSettings::default()
    };
    let mut tracker = Tracker::new(&[CameraPose::alone(Some(CAMERA_M))], settings).unwrap();
    for frame in 0..70 {
        let at_s = f64::from(frame) / 5.0;
        let places = (0..320).map(|n| person(f64::from(n % 20) - 10.0, f64::from(n / 20) - 10.0));
        tracker
            .update(f64::INFINITY, 0, at_s, &places.collect::<Vec<_>>())
            .unwrap();
    }
    assert_eq!(tracker.tracks().count(), 20);
    assert!(
        tracker
            .tracks()
            .all(|track| track.tail().len() == MAX_TAIL_POINTS)
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn the_order_of_the_persons_changes_nothing(
        frames in prop::collection::vec(
            prop::collection::vec((-5.0..5.0_f64, -5.0..5.0_f64, 0.0..1.0_f64), 0..8),
            1..12,
        ),
        turn in any::<usize>(),
    ) {
        let (mut straight, mut shuffled) = (floor_tracker(), floor_tracker());
        for (frame, persons) in (0_u32..).zip(&frames) {
            let at_s = f64::from(frame) / 2.0;
            let persons: Vec<_> = persons.iter().map(|&(x, y, s)| with_score(x, y, s)).collect();
            straight.update(f64::INFINITY, 0, at_s, &persons).unwrap();
            let mut other = persons.clone();
            other.rotate_left(turn % persons.len().max(1));
            other.reverse();
            shuffled.update(f64::INFINITY, 0, at_s, &other).unwrap();
            let states = |tracker: &Tracker| -> Vec<_> {
                let tracks = tracker.tracks();
                tracks.map(|t| (t.id, t.place(Plane::FloorM), t.velocity_m_s(), t.seen_s)).collect()
            };
            prop_assert_eq!(states(&straight), states(&shuffled));
        }
    }

    #[test]
    fn identifiers_are_unique_and_end_with_the_absence(
        places in prop::collection::vec((-5.0..5.0_f64, -5.0..5.0_f64), 1..60),
        max_absent_s in prop::sample::select(vec![0.0, 120.0]),
    ) {
        let settings = TrackerSettings { max_absent_s, ..TrackerSettings::default() };
        let mut tracker = Tracker::new(&[CameraPose::alone(Some(CAMERA_M))], settings).unwrap();
        let mut ended = std::collections::BTreeSet::new();
        for (frame, (x, y)) in (0_u32..).zip(places) {
            let persons = [person(x, y)];
            for track in tracker.update(f64::INFINITY, 0, f64::from(frame), &persons).unwrap() {
                ended.insert(track.id.0);
            }
            let present = ids(&tracker);
            prop_assert!(present.windows(2).all(|pair| pair[0] < pair[1]));
            prop_assert!(max_absent_s > 0.0 || present.iter().all(|id| !ended.contains(id)));
        }
    }
}
