//! The current tracks, with their last places.

use std::collections::BTreeMap;

use axum::{
    Json,
    extract::{Path, State},
};
use jiff::Timestamp;
use serde::Serialize;
use serde_json::{Value, json};

use super::{Problem, Shared, check_known, now_ms};
use crate::{
    engine::Engine,
    scene::{Scene, SceneCamera},
    snapshot::LineSnapshot,
    sums::Owner,
    tracking::{Plane, TailPoint, Track},
};

/// Longest tail of an answer, seconds.
const TAIL_S: f64 = 5.0;

/// Parts of a line in the frame: a straight line on the floor is a curve there.
const OUTLINE_SEGMENTS: u32 = 16;

/// The current tracks of a camera or a site.
#[derive(Serialize)]
pub(super) struct Tracks {
    /// Time of the last frame; null before the first.
    last_report: Option<Timestamp>,
    /// False if the last frame is older than the longest gap: there are no tracks then.
    is_current: bool,
    #[serde(rename = "tracks")]
    rows: Vec<TrackRow>,
    /// The lines and zones of the camera with their counts.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    lines: Vec<Value>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    zones: Vec<Value>,
}

/// A track. Places are on the floor in metres, or in frame pixels.
#[derive(Serialize)]
struct TrackRow {
    id: u64,
    first_seen: Option<Timestamp>,
    last_seen: Option<Timestamp>,
    #[serde(skip_serializing_if = "Option::is_none")]
    floor_m: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    velocity_m_s: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    frame_px: Option<[f64; 2]>,
    tail: Vec<[f64; 2]>,
}

pub(super) async fn of_camera(
    State(api): State<Shared>,
    Path(camera): Path<String>,
) -> Result<Json<Tracks>, Problem> {
    check_known(&api, &Owner::Camera(camera.clone())).await?;
    let engine = api.engine.lock();
    let answer = engine
        .scene_of(&camera)
        .map(|scene| tracks(&engine, scene, Some(&camera)));
    Ok(Json(answer.unwrap_or_else(Tracks::none)))
}

pub(super) async fn of_site(
    State(api): State<Shared>,
    Path(site): Path<String>,
) -> Result<Json<Tracks>, Problem> {
    check_known(&api, &Owner::Site(site.clone())).await?;
    let engine = api.engine.lock();
    let answer = engine.site(&site).map(|scene| tracks(&engine, scene, None));
    Ok(Json(answer.unwrap_or_else(Tracks::none)))
}

fn tracks(engine: &Engine, scene: &Scene, camera: Option<&str>) -> Tracks {
    let of_camera = camera.and_then(|name| scene.camera(name));
    let presence = of_camera.map_or(scene.presence(), |(_, camera)| camera.presence());
    let now_ms = now_ms();
    let is_current = presence
        .last_ms
        .is_some_and(|last_ms| now_ms - last_ms <= engine.longest_gap_ms());
    let is_site = matches!(scene.owner, Owner::Site(_));
    let seen = scene.tracks().filter(|track| match of_camera {
        Some((index, _)) if is_site => track.last_person().camera == index,
        _ => true,
    });
    let snapshot = camera.and_then(|name| {
        let mut cameras = engine.snapshot(now_ms).cameras.into_iter();
        cameras.find(|camera| camera.name == name)
    });
    let (lines, zones) = snapshot
        .map(|camera| (camera.lines, camera.zones))
        .unwrap_or_default();
    Tracks {
        last_report: presence
            .last_ms
            .and_then(|last_ms| Timestamp::from_millisecond(last_ms).ok()),
        rows: seen.filter(|_| is_current).map(|track| row(track, is_site)).collect(),
        is_current,
        lines: of_camera.map_or_else(Vec::new, |(_, camera)| line_rows(camera, &lines)),
        zones: zones
            .into_iter()
            .map(|zone| {
                json!({ "zone": zone.zone, "persons": zone.persons, "entries": zone.entries })
            })
            .collect(),
    }
}

impl Tracks {
    /// A camera that was followed before.
    fn none() -> Self {
        Self {
            last_report: None,
            is_current: false,
            rows: Vec::new(),
            lines: Vec::new(),
            zones: Vec::new(),
        }
    }
}

/// Returns the lines with their totals and their places in the frame.
fn line_rows(camera: &SceneCamera, totals: &[LineSnapshot]) -> Vec<Value> {
    let geometry = camera.definition.geometry.as_ref();
    let lines = geometry.into_iter().flat_map(|geometry| {
        let lines = geometry.areas.lines.iter();
        lines.map(|line| {
            (
                line,
                line.outline(&geometry.lens, &geometry.mount, OUTLINE_SEGMENTS),
            )
        })
    });
    let rows = lines.map(|(line, outline)| {
        let of_line = totals.iter().filter(|total| total.line == line.name);
        let crossings: BTreeMap<_, _> = of_line
            .map(|total| (total.direction.as_str(), total.crossings))
            .collect();
        let outline = outline.into_iter().flatten();
        let outline: Vec<_> = outline.map(|point| rounded([point.x, point.y])).collect();
        json!({ "line": line.name, "crossings": crossings, "outline_px": outline })
    });
    rows.collect()
}

fn row(track: &Track, is_site: bool) -> TrackRow {
    let floor_m = track.place(Plane::FloorM);
    let plane = if floor_m.is_some() {
        Plane::FloorM
    } else {
        Plane::FramePx
    };
    let since = track.seen_s() - TAIL_S;
    let recent = track.tail().filter(|point| point.at_s >= since);
    let tail = recent.filter_map(|point: &TailPoint| point.place(plane));
    TrackRow {
        id: track.id().0,
        first_seen: time(track.first_seen_s()),
        last_seen: time(track.seen_s()),
        floor_m: floor_m.map(rounded),
        velocity_m_s: track.velocity_m_s().map(rounded),
        // A place in the frame is one of the camera that saw the track last.
        frame_px: track
            .place(Plane::FramePx)
            .filter(|_| !is_site)
            .map(rounded),
        tail: tail.map(rounded).collect(),
    }
}

fn rounded(place: [f64; 2]) -> [f64; 2] {
    place.map(|value| (value * 1000.0).round() / 1000.0)
}

fn time(seconds: f64) -> Option<Timestamp> {
    #[expect(clippy::cast_possible_truncation, reason = "times of reports")]
    let milliseconds = (seconds * 1000.0).round() as i64;
    Timestamp::from_millisecond(milliseconds).ok()
}
