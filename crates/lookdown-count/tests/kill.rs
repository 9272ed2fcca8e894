//! A process that is killed at any moment neither loses nor invents counts.
#![expect(clippy::unwrap_used, reason = "a panic fails the test")]

#[allow(dead_code, reason = "shared with the other tests")]
mod events;

use std::{
    path::Path,
    process::{Command, Stdio},
    sync::atomic::Ordering,
    time::Duration,
};

use events::{CALIBRATION, Server, walks};
use lookdown_common::ServerEntry;
use lookdown_count::{CountEntry, CountOptions, Snapshot, count};
use rusqlite::Connection;
use tokio::{sync::watch, time::sleep};

/// Kills of the test.
const KILLS: u64 = 25;

fn settings(server: &str, store: &Path) -> CountOptions {
    let entry = CountEntry {
        server: ServerEntry {
            url: Some(server.to_owned()),
            ..ServerEntry::default()
        },
        listen: Some(([127, 0, 0, 1], 0).into()),
        store: store.to_owned(),
        retention: Duration::from_hours(24 * 3660),
        commit_every: Duration::from_millis(100),
        ..CountEntry::default()
    };
    entry.check().unwrap()
}

/// The process that is killed: this test again, with the server and the store in its environment.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "started by the test"]
async fn companion() {
    let variable = |name: &str| std::env::var(name).unwrap();
    let options = settings(
        &variable("COUNT_SERVER"),
        Path::new(&variable("COUNT_STORE")),
    );
    let (snapshots, _receiver) = watch::channel(Snapshot::default());
    count(&options, snapshots, |_| {}, std::future::pending())
        .await
        .unwrap();
}

/// Counts in this process until the last report is stored.
async fn count_to_the_end(server: &Server, store: &Path, last: u64) {
    let options = settings(&format!("http://{}", server.address), store);
    let (snapshots, _receiver) = watch::channel(Snapshot::default());
    let stop = async {
        while progress(store) < last {
            sleep(Duration::from_millis(50)).await;
        }
    };
    count(&options, snapshots, |_| {}, stop).await.unwrap();
}

fn progress(store: &Path) -> u64 {
    let connection = Connection::open(store).unwrap();
    let last = connection.query_row("SELECT last_event FROM progress", [], |row| row.get(0));
    last.unwrap_or(0_i64).cast_unsigned()
}

/// Returns all rows of the sums as text.
fn sums(store: &Path) -> Vec<String> {
    let connection = Connection::open(store).unwrap();
    let tables = [
        "presence",
        "crossings",
        "zones",
        "cells",
        "line_totals",
        "zone_totals",
        "progress",
    ];
    let mut rows = Vec::new();
    for table in tables {
        let mut statement = connection
            .prepare(&format!("SELECT * FROM {table}"))
            .unwrap();
        let columns = statement.column_count();
        let mut found = statement.query([]).unwrap();
        while let Some(row) = found.next().unwrap() {
            let values = (0..columns).map(|column| format!("{:?}", row.get_ref(column).unwrap()));
            rows.push(format!("{table}: {}", values.collect::<Vec<_>>().join(" ")));
        }
    }
    rows
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_killed_process_counts_as_an_uninterrupted_one() {
    let folder = tempfile::tempdir().unwrap();
    let events = walks("hall", 400, 200..240);
    let last = events.last().unwrap().0;
    let whole = Server::start(events.clone(), Duration::ZERO, CALIBRATION).await;
    let uninterrupted = folder.path().join("whole.sqlite");
    count_to_the_end(&whole, &uninterrupted, last).await;

    let server = Server::start(events, Duration::from_millis(80), CALIBRATION).await;
    let interrupted = folder.path().join("killed.sqlite");
    let mut random = 7_u64;
    for kill in 0..KILLS {
        let mut process = Command::new(std::env::current_exe().unwrap())
            .args(["companion", "--exact", "--ignored"])
            .env("COUNT_SERVER", format!("http://{}", server.address))
            .env("COUNT_STORE", &interrupted)
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        random = random
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(kill);
        sleep(Duration::from_millis(150 + (random >> 33) % 350)).await;
        process.kill().unwrap();
        process.wait().unwrap();
    }
    let reached = if interrupted.exists() {
        progress(&interrupted)
    } else {
        0
    };
    let sent = server.sent.load(Ordering::SeqCst);
    let resumed = server.resumed.lock().unwrap().clone();
    assert!(reached > 0 && reached <= sent, "{reached} {sent}");
    assert!(reached < last, "the kills came too late to prove anything");
    assert!(resumed.iter().flatten().count() > 5, "{resumed:?}");
    count_to_the_end(&server, &interrupted, last).await;

    let (expected, counted) = (sums(&uninterrupted), sums(&interrupted));
    assert_eq!(expected, counted);
    let crossings: Vec<_> = expected
        .iter()
        .filter(|row| row.starts_with("line_totals"))
        .collect();
    assert_eq!(crossings.len(), 2, "{crossings:?}");
}
