use proptest::prelude::*;

use super::*;
use crate::scene_camera::LATE_LIMIT;

fn jump() -> impl Strategy<Value = i64> {
    let second = 1000_i64;
    let jumps = [0, 1, 4, 20, 240, 3600, 86_400, 315_360_000];
    prop_oneof![
        proptest::sample::select(jumps.map(|jump| jump * second).to_vec()),
        proptest::sample::select(jumps.map(|jump| -jump * second).to_vec()),
        -20_000..20_000_i64,
    ]
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let step = prop_oneof![
        4 => (1..25_i64).prop_map(|seconds| Step::Run { seconds }),
        2 => jump().prop_map(|ahead_ms| Step::ServerClock { ahead_ms }),
        2 => jump().prop_map(|ahead_ms| Step::CameraClock { ahead_ms }),
        1 => jump().prop_map(|ahead_ms| Step::OwnClock { ahead_ms }),
        2 => Just(Step::RestartServer),
        1 => Just(Step::Disconnect),
        1 => Just(Step::Kill),
        1 => Just(Step::HugeId),
    ];
    proptest::collection::vec(step, 1..14)
}

fn check(site: Option<&str>, steps: &[Step]) -> Result<(), TestCaseError> {
    let mut world = World::new(site);
    for step in steps {
        world.step(step);
    }
    // Connecting takes a second.
    world.run(i64::try_from(LATE_LIMIT.as_secs()).unwrap() + 2);
    prop_assert!(world.crossings() <= world.true_crossings);
    let settled = (world.sent.len(), world.crossings());
    world.run(24);
    for (number, sent) in world.sent.iter().enumerate() {
        prop_assert!(sent.counted <= 1, "report {number} is counted twice");
        let is_missed = number >= settled.0 && sent.counted == 0;
        prop_assert!(!is_missed, "report {number} is not counted: {}", sent.json);
    }
    // Four passes; one may be under way at either end.
    prop_assert!(world.crossings() >= settled.1 + 3);
    prop_assert!(world.crossings() <= world.true_crossings);
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn counting_survives_any_clock_jumps(steps in steps()) {
        check(None, &steps)?;
    }

    #[test]
    fn a_site_survives_any_clock_jumps(steps in steps()) {
        check(Some("ground"), &steps)?;
    }
}

/// The server is an hour ahead, and right after a restart.
#[test]
fn counting_continues_after_a_clock_that_was_ahead() {
    let mut world = World::new(None);
    world.step(&Step::ServerClock {
        ahead_ms: 3_600_000,
    });
    world.run(10);
    world.step(&Step::ServerClock { ahead_ms: 0 });
    world.step(&Step::RestartServer);
    world.run(10);
    let counted = world.sent.iter().filter(|sent| sent.counted == 1).count();
    // Each connection takes a second, in which two cameras have five frames each. Their latest
    // reports arrive with the connection.
    assert_eq!(counted, world.sent.len() - 2 * (10 - 2));
    assert_eq!(world.counter.position_resets, 1);
}

#[test]
fn an_absurd_id_stops_no_counting() {
    let mut world = World::new(None);
    world.run(10);
    world.step(&Step::HugeId);
    world.run(10);
    let counted = world.sent.iter().filter(|sent| sent.counted == 1).count();
    // The connection takes a second. The report with the ID has the time of the one before.
    assert_eq!(counted, world.sent.len() - 8 - 1);
}

#[test]
fn repeated_and_late_reports_are_shown_as_dropped() {
    let mut world = World::new(None);
    world.run(4);
    let (id, number) = *world.server.kept.last().unwrap();
    world.deliver(id, number);
    let drops = world.counter.drops.for_camera("hall").unwrap();
    assert_eq!((drops.reports, drops.reason.label()), (1, "repeated"));
    assert_eq!(drops.since_ms, Some(world.true_ms));

    world.step(&Step::CameraClock { ahead_ms: -4_000 });
    world.run(1);
    let drops = world.counter.drops.for_camera("hall").unwrap();
    assert_eq!((drops.reports, drops.reason.label()), (6, "out_of_order"));
    world.run(10);
    let drops = world.counter.drops.for_camera("hall").unwrap();
    assert_eq!(drops.since_ms, None);
}

/// A camera of the year 2036 neither counts as current nor ends the others.
#[test]
fn a_report_of_the_future_changes_no_other_camera() {
    let mut world = World::new(None);
    world.run(4);
    let present_ms = world.true_ms;
    world.step(&Step::ServerClock {
        ahead_ms: 315_360_000_000,
    });
    let number = world.capture(0, &[]);
    world.deliver(u64::MAX / 2, number);
    let snapshot = world.counter.snapshot(present_ms);
    let [gate, hall] = snapshot.cameras.as_slice() else {
        panic!("{snapshot:?}");
    };
    assert!(gate.last_report_ms > present_ms && gate.persons.is_none());
    assert_eq!(hall.persons, Some(1));
    world.counter.forget_silent(present_ms);
    assert!(world.counter.scene_of("hall").is_some());
}
