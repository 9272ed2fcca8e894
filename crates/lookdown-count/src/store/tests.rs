use lookdown_tracking::heat_map::Cell;

use super::{write::Message, *};
use crate::{
    scene::Batch,
    sums::{DAY_MS, LineDirection, MINUTE_MS, Owner, PresenceSum, Sums, TimeSpan, ZoneOf, ZoneSum},
};

fn door() -> LineDirection {
    LineDirection {
        camera: "hall".to_owned(),
        line: "door".to_owned(),
        direction: "in".to_owned(),
    }
}

fn batch(minute: i64, last_event: u64) -> Batch {
    let mut batch = Batch {
        last_event,
        ..Batch::default()
    };
    let hall = Owner::Camera("hall".to_owned());
    let presence = PresenceSum {
        known_ms: 30_000,
        person_ms: 60_000,
        most: 3,
        bar_ms: Some([30_000, 90_000]),
    };
    let till = ZoneOf {
        camera: "hall".to_owned(),
        zone: "till".to_owned(),
    };
    let zone = ZoneSum {
        entries: 1,
        visits: 1,
        visit_ms: 2_000,
        person_ms: 2_000,
        most: 1,
    };
    let cell = Cell { column: -3, row: 4 };
    batch.sums = Sums {
        presence: [((hall.clone(), minute), presence)].into(),
        slow: [(("hall".to_owned(), minute), 5_000)].into(),
        crossings: [((door(), minute), 2)].into(),
        zones: [((till, minute), zone)].into(),
        cells: [((hall, 0, cell), 500)].into(),
    };
    batch
}

#[test]
fn removed_camera_has_no_sums() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(&folder.path().join("counts.sqlite")).unwrap();
    store.commit(&batch(0, 7), &[], None).unwrap();
    store.put_reference_crossings(&door(), 0, 3).unwrap();
    let hall = Owner::Camera("hall".to_owned());
    store.remove("gate").unwrap();
    assert!(store.has(&hall).unwrap());
    store.remove("hall").unwrap();
    assert!(!store.has(&hall).unwrap());
    let tables = [
        "bars",
        "reference_crossings",
        "cells",
        "slow",
        "crossings",
        "zones",
        "line_totals",
        "zone_totals",
    ];
    for table in tables {
        let rows = format!("SELECT count(*) FROM {table}");
        let rows = store.reader.lock().query_row(&rows, [], |row| row.get(0));
        assert_eq!(rows, Ok(0), "{table}");
    }
}

#[test]
fn sums_of_batches_add_up_over_steps() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(&folder.path().join("counts.sqlite")).unwrap();
    for minute in [0, 0, 1, 17] {
        store.commit(&batch(minute, 7), &[], None).unwrap();
    }
    let hall = Owner::Camera("hall".to_owned());
    let span = |step| Span {
        from_minute: 0,
        to_minute: 30,
        step_minutes: step,
    };
    let steps = store.steps(&hall, span(15), 100).unwrap().unwrap();
    assert_eq!(steps.keys().copied().collect::<Vec<_>>(), [0, 1]);
    assert_eq!(steps[&0].presence.known_ms, 90_000);
    assert_eq!(steps[&0].slow_ms, 15_000);
    assert!(store.steps(&hall, span(15), 3).unwrap().is_none());
    let whole = &store.steps(&hall, span(30), 100).unwrap().unwrap()[&0];
    assert_eq!(
        (whole.presence.person_ms, whole.presence.most),
        (240_000, 3)
    );
    assert_eq!(whole.presence.bar_ms, Some([120_000, 360_000]));
    let door = ("door".to_owned(), "in".to_owned());
    assert_eq!(whole.crossings[&door], 8);
    assert_eq!(
        (whole.zones["till"].entries, whole.zones["till"].most),
        (4, 1)
    );
    let time = TimeSpan {
        from_ms: 0,
        to_ms: 1,
    };
    let cells = store.cells(&hall, time).unwrap();
    assert_eq!(cells[&Cell { column: -3, row: 4 }], 2_000);
    let resumed = store.resumed().unwrap();
    assert_eq!(resumed.last_event, 7);
    assert_eq!(
        resumed
            .totals
            .crossings
            .values()
            .copied()
            .collect::<Vec<_>>(),
        [8]
    );
}

#[test]
fn a_bar_is_unknown_where_a_part_has_none() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(&folder.path().join("counts.sqlite")).unwrap();
    store.commit(&batch(0, 7), &[], None).unwrap();
    let mut without = batch(1, 8);
    for sum in without.sums.presence.values_mut() {
        sum.bar_ms = None;
    }
    store.commit(&without, &[], None).unwrap();
    let bar = |step_minutes| {
        let span = Span {
            from_minute: 0,
            to_minute: 2,
            step_minutes,
        };
        let hall = Owner::Camera("hall".to_owned());
        store.steps(&hall, span, 100).unwrap().unwrap()[&0]
            .presence
            .bar_ms
    };
    assert_eq!((bar(1), bar(2)), (Some([30_000, 90_000]), None));
}

#[test]
fn the_oldest_hours_with_reference_crossings_make_room() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(&folder.path().join("counts.sqlite")).unwrap();
    for hour in 0..70 {
        store
            .put_reference_crossings(&door(), hour * 60, 3)
            .unwrap();
    }
    let kept = store.reference_crossings("hall").unwrap();
    assert_eq!((kept.len(), kept[0].from.as_second()), (60, 600 * 60));
}

#[test]
fn old_sums_expire_and_totals_stay() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(&folder.path().join("counts.sqlite")).unwrap();
    store.commit(&batch(1, 7), &[], None).unwrap();
    store.commit(&batch(100, 8), &[], None).unwrap();
    store.expire(60 * 60_000).unwrap();
    let hall = Owner::Camera("hall".to_owned());
    let span = Span {
        from_minute: 0,
        to_minute: 200,
        step_minutes: 200,
    };
    assert_eq!(
        store.steps(&hall, span, 100).unwrap().unwrap()[&0]
            .presence
            .known_ms,
        30_000
    );
    assert_eq!(
        store
            .resumed()
            .unwrap()
            .totals
            .crossings
            .values()
            .sum::<u64>(),
        4
    );
}

#[test]
fn a_clock_that_is_ahead_removes_one_day_at_most() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(&folder.path().join("counts.sqlite")).unwrap();
    let day = DAY_MS / MINUTE_MS;
    for (event, minute) in [(0, 10), (1, 100), (2, day + 100), (3, 3 * day)] {
        store.commit(&batch(minute, event), &[], None).unwrap();
    }
    let hall = Owner::Camera("hall".to_owned());
    let known_days = || {
        let span = Span {
            from_minute: 0,
            to_minute: 4 * day,
            step_minutes: day,
        };
        let steps = store.steps(&hall, span, 100).unwrap().unwrap();
        let known = steps
            .into_iter()
            .filter(|(_, step)| step.presence.known_ms > 0);
        known.map(|(number, _)| number).collect::<Vec<_>>()
    };
    assert_eq!(known_days(), [0, 1, 3]);
    let ten_years_later = 3650 * DAY_MS;
    store.expire(ten_years_later).unwrap();
    assert_eq!(known_days(), [1, 3]);
    store.expire(ten_years_later).unwrap();
    assert_eq!(known_days(), [3]);
}

#[test]
fn messages_stay_until_they_are_removed() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(&folder.path().join("counts.sqlite")).unwrap();
    let message = Message {
        id: "msg_1".to_owned(),
        webhook: "digest".to_owned(),
        body: "{}".to_owned(),
        created_s: 5,
    };
    for _ in 0..2 {
        store
            .commit(
                &Batch {
                    last_event: 1,
                    ..Batch::default()
                },
                std::slice::from_ref(&message),
                None,
            )
            .unwrap();
    }
    assert_eq!(store.resumed().unwrap().messages, [message]);
    store.remove_message("msg_1").unwrap();
    assert!(store.resumed().unwrap().messages.is_empty());
}

#[test]
fn a_store_has_one_user_and_a_known_version() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("counts.sqlite");
    let store = Store::open(&path).unwrap();
    let second = Store::open(&path).err().unwrap().to_string();
    assert!(second.contains("is in use by another process"), "{second}");
    store
        .writer
        .lock()
        .pragma_update(None, "user_version", 9)
        .unwrap();
    drop(store);
    let later = Store::open(&path).err().unwrap().to_string();
    assert!(later.contains("has the version 9"), "{later}");
    let other = folder.path().join("other");
    std::fs::write(
        &other,
        "no database at all, but long enough for a header".repeat(20),
    )
    .unwrap();
    let refused = Store::open(&other).err().unwrap().to_string();
    assert!(refused.contains("cannot be used"), "{refused}");
}

#[test]
fn tracks_of_another_version_begin_again_and_counts_stay() {
    // Its tracks have the version 2.
    let earlier = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../tests/fixtures/upgrade/0.1.0/counts.sqlite"
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("counts.sqlite");
    std::fs::copy(earlier, &path).unwrap();
    let store = Store::open(&path).unwrap();
    let resumed = store.resumed().unwrap();
    assert!(resumed.scenes.is_empty());
    assert!(resumed.last_event > 0);
}

#[test]
fn files_of_the_store_are_readable_by_the_owner_alone() {
    use std::os::unix::fs::PermissionsExt as _;

    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(&folder.path().join("counts.sqlite")).unwrap();
    store.commit(&batch(1, 7), &[], None).unwrap();
    let mut files = 0;
    for entry in std::fs::read_dir(folder.path()).unwrap() {
        let entry = entry.unwrap();
        let mode = entry.metadata().unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600, "{:?}", entry.file_name());
        files += 1;
    }
    assert!(files >= 3, "{files}");
}

#[test]
fn a_store_with_code_and_a_pipe_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("counts.sqlite");
    drop(Store::open(&path).unwrap());
    let foreign = Connection::open(&path).unwrap();
    let trigger = "CREATE TRIGGER t AFTER INSERT ON scenes BEGIN DELETE FROM zones; END";
    foreign.execute_batch(trigger).unwrap();
    drop(foreign);
    let refused = |path: &Path| Store::open(path).err().unwrap().to_string();
    assert!(refused(&path).contains("it has views, triggers"));
    let pipe = folder.path().join("pipe");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.unwrap().success());
    assert!(refused(&pipe).contains("it is not a regular file"));
}
