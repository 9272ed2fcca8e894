use super::*;

#[test]
fn steps_times_columns_are_bounded() {
    let owner = || Owner::Camera("hall".to_owned());
    let span = |steps| Span {
        from_minute: 0,
        to_minute: steps,
        step_minutes: 1,
    };
    let names = |zones: usize| {
        let zones = (0..zones).map(|number| format!("zone {number}"));
        (BTreeSet::new(), zones.collect())
    };
    let ratios = Ratios::default();
    let about = |zones| (names(zones), &ratios);
    let found = |steps, zones| counts(owner(), span(steps), &BTreeMap::new(), about(zones));
    assert!(found(10_000, 9).is_some());
    assert!(found(10_000, 10).is_none());
    assert!(found(1, MAX_VALUES).is_none());
    // Columns of the stored sums count as well.
    let mut step = Step::default();
    for line in 0..10 {
        let direction = (line.to_string(), "in".to_owned());
        step.crossings.insert(direction, 1);
    }
    let sums = BTreeMap::from([(0, step)]);
    assert!(counts(owner(), span(10_000), &sums, about(0)).is_none());
}
