//! `lookdown calibration place`: the place of a camera on the floor of another.

use std::{
    collections::BTreeMap,
    io::{self, Write},
    process::ExitCode,
    time::Duration,
};

use anyhow::{Context, bail};
use clap::Args;
use jiff::Timestamp;
use lookdown_calibration::native::{NativeSource, SourcedValue};
use lookdown_common::ServerClient;
use lookdown_tracking::{RelativePose, Walk, relative_pose};
use serde::Deserialize;
use serde_json::json;
use tokio::time;

use crate::cli::{
    async_runtime::for_this_thread,
    progress::UNWRITABLE,
    server_flags::{ServerFlags, read_json},
};

/// Interval of the questions for tracks.
const INTERVAL: Duration = Duration::from_millis(500);
/// Interval of the lines that report the progress.
const PROGRESS: Duration = Duration::from_secs(30);
/// Most people of a camera. Those of four hours in a busy hall are fewer.
const MAX_WALKS: usize = 10_000;

/// Arguments of `lookdown calibration place`.
#[derive(Debug, Args)]
pub(in super::super) struct Arguments {
    /// The camera whose floor the places are on, such as the first one of a site
    #[arg(value_name = "FIRST")]
    first: String,
    /// The camera that is placed
    #[arg(value_name = "CAMERA")]
    camera: String,
    /// Time for which the people of both cameras are followed, minutes
    #[arg(long, value_name = "MINUTES", default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=240))]
    minutes: u64,
    #[command(flatten)]
    server: ServerFlags,
}

/// The parts of `GET /counts/{camera}/tracks` that are used.
#[derive(Deserialize)]
struct Answer {
    tracks: Vec<TrackRow>,
}

#[derive(Deserialize)]
struct TrackRow {
    id: u64,
    last_seen: Timestamp,
    floor_m: Option<[f64; 2]>,
}

/// The walks of the tracks of one camera.
#[derive(Default)]
struct Walks(BTreeMap<u64, Walk>);

/// Prints the place as a part of a calibration in the native format, with its sources.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let (first, second) = for_this_thread()?.block_on(follow(arguments))?;
    let (on, camera) = (&arguments.first, &arguments.camera);
    let pose = relative_pose(&first.all(), &second.all())
        .with_context(|| format!("{camera} cannot be placed on the floor of {on}"))?;
    let RelativePose {
        position_m,
        yaw_deg,
        position_sd_m,
        yaw_sd_deg,
        walks,
        residual_m,
        ..
    } = pose;
    eprintln!(
        "lookdown: {camera} is at the printed place of the floor of {on} (standard deviations {position_sd_m:.2} m and \
         {yaw_sd_deg:.1}°), by {walks} walks whose places differ by {residual_m:.2} m: give both the same mount.site"
    );
    let [x, y] = position_m.map(|value| rounded(value, 100.0));
    let place = json!({
        "mount": {"position_m": [x, y], "yaw_deg": rounded(yaw_deg, 10.0)},
        "sources": BTreeMap::from([
            (SourcedValue::PositionM, NativeSource::from_people(rounded(position_sd_m, 100.0))),
            (SourcedValue::YawDeg, NativeSource::from_people(rounded(yaw_sd_deg, 10.0))),
        ]),
    });
    writeln!(io::stdout(), "{place}").context(UNWRITABLE)?;
    Ok(ExitCode::SUCCESS)
}

fn rounded(value: f64, steps: f64) -> f64 {
    // Not -0.
    (value * steps).round() / steps + 0.0
}

/// Follows the people of both cameras.
async fn follow(arguments: &Arguments) -> anyhow::Result<(Walks, Walks)> {
    let client = arguments.server.client()?;
    let (mut first, mut second) = (Walks::default(), Walks::default());
    let end = time::Instant::now() + Duration::from_secs(60 * arguments.minutes);
    let mut last_reported = time::Instant::now();
    let mut ticks = time::interval(INTERVAL);
    ticks.set_missed_tick_behavior(time::MissedTickBehavior::Delay);
    while time::Instant::now() < end {
        ticks.tick().await;
        first.add(tracks(&client, &arguments.first).await?, &arguments.first)?;
        second.add(tracks(&client, &arguments.camera).await?, &arguments.camera)?;
        if last_reported.elapsed() >= PROGRESS {
            last_reported = time::Instant::now();
            let left = end.saturating_duration_since(last_reported).as_secs();
            let (one, other) = (first.0.len(), second.0.len());
            eprintln!("lookdown: {one} and {other} people followed, {left} s left");
        }
    }
    Ok((first, second))
}

async fn tracks(client: &ServerClient, camera: &str) -> anyhow::Result<Answer> {
    let url = client.route(["counts", camera, "tracks"]);
    read_json(client, url, "tracks").await.context(
        "give the address of `lookdown run` or `count` with --server, such as http://127.0.0.1:8090",
    )
}

impl Walks {
    /// Adds the places of the tracks, each once.
    fn add(&mut self, answer: Answer, camera: &str) -> anyhow::Result<()> {
        for TrackRow {
            id,
            last_seen,
            floor_m,
        } in answer.tracks
        {
            let Some(place) = floor_m else {
                bail!("{camera} has no places on the floor: set mount.height_m of its calibration");
            };
            if self.0.len() >= MAX_WALKS && !self.0.contains_key(&id) {
                bail!("{camera} has more than {MAX_WALKS} people: give fewer --minutes");
            }
            let at_s = last_seen.as_duration().as_secs_f64();
            let walk = self.0.entry(id).or_default();
            if walk.last().is_none_or(|(last, _)| *last < at_s) {
                walk.push((at_s, place));
            }
        }
        Ok(())
    }

    fn all(self) -> Vec<Walk> {
        self.0.into_values().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_that_was_told_twice_is_added_once() {
        let answer = |second: u8, x: f64| -> Answer {
            let last_seen = format!("2026-11-22T10:00:0{second}Z");
            serde_json::from_value(json!({
                "tracks": [{"id": 3, "first_seen": last_seen, "last_seen": last_seen, "floor_m": [x, 1.0]}]
            }))
            .unwrap()
        };
        let mut walks = Walks::default();
        for (second, x) in [(0, 1.0), (0, 1.0), (1, 1.5)] {
            walks.add(answer(second, x), "hall").unwrap();
        }
        let places: Vec<_> = walks
            .all()
            .concat()
            .into_iter()
            .map(|(_, place)| place)
            .collect();
        assert_eq!(places, [[1.0, 1.0], [1.5, 1.0]]);
    }

    #[test]
    fn a_camera_without_a_height_is_refused() {
        let answer =
            r#"{"tracks": [{"id": 1, "last_seen": "2026-11-22T10:00:00Z", "frame_px": [1, 2]}]}"#;
        let refused = Walks::default().add(serde_json::from_str(answer).unwrap(), "hall");
        assert!(refused.unwrap_err().to_string().contains("mount.height_m"));
    }
}
