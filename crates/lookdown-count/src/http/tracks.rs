//! The current tracks, with their last places.

use std::collections::BTreeMap;

use axum::{
    Json,
    extract::{Path, State},
};
use jiff::Timestamp;
use lookdown_http::problem::Problem;
use lookdown_tracking::{Plane, TailPoint, Track};
use serde::Serialize;
use utoipa::ToSchema;

use super::{
    floor::PersonOnFloor,
    furniture::{Thing, things},
    shared::{Shared, check_known, now_ms, rounded},
};
use crate::{
    counter::Counter,
    now::{milliseconds, time_of},
    scene::Scene,
    scene_camera::SceneCamera,
    snapshot::{LineSnapshot, ZoneSnapshot},
    sums::Owner,
};

/// Longest tail of an answer, seconds.
const TAIL_S: f64 = 5.0;

/// Parts of a line or of an edge of a zone in the frame: a straight line on the floor is a curve
/// there.
const OUTLINE_SEGMENTS: u32 = 16;

/// The current tracks of a camera or a site.
#[derive(Default, Serialize, ToSchema)]
#[expect(clippy::struct_field_names, reason = "names of the answer")]
pub(super) struct Tracks {
    /// Time of the last frame; null before the first.
    last_report: Option<Timestamp>,
    /// False if the last frame is older than the longest gap: there are no tracks then.
    is_current: bool,
    tracks: Vec<TrackRow>,
    /// The lines and zones of the camera with their counts.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    lines: Vec<LineRow>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    zones: Vec<ZoneRow>,
    /// The things that stand in the frame of the camera, furniture and candidates.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    furniture: Vec<Thing>,
    /// The people on the floor of the camera who are an alert.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    floor_alerts: Vec<PersonOnFloor>,
}

/// A line of a camera.
#[derive(Serialize, ToSchema)]
struct LineRow {
    line: String,
    directions: [String; 2],
    /// Crossings by direction since the store was created.
    crossings: BTreeMap<String, u64>,
    /// In the frame.
    outline_px: Vec<[f64; 2]>,
}

/// A zone of a camera.
#[derive(Serialize, ToSchema)]
struct ZoneRow {
    zone: String,
    /// Persons now; null while unknown.
    persons: Option<u64>,
    entries: u64,
    /// In the frame.
    outline_px: Option<Vec<[f64; 2]>>,
}

/// A track. Places are on the floor in meters, or in frame pixels of the camera.
#[derive(Serialize, ToSchema)]
struct TrackRow {
    id: u64,
    first_seen: Timestamp,
    last_seen: Timestamp,
    /// `upright`, `seated`, `low`, `lying` or `unknown`, from all boxes so far.
    posture: &'static str,
    /// Probability of the most likely posture; below 0.5 the posture is `unknown`.
    posture_probability: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    floor_m: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    velocity_m_s: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    frame_px: Option<[f64; 2]>,
    /// On the floor, or in the frame without the camera's height.
    tail: Vec<[f64; 2]>,
    /// In the frame; absent for a site.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    tail_px: Option<Vec<[f64; 2]>>,
}

/// Get the tracks of a camera
#[utoipa::path(
    get, path = "/counts/{camera}/tracks", tag = "counts", operation_id = "get_camera_tracks",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    params(("camera" = String, Path, description = "The name of the camera.")),
    responses((status = OK, description = "The current tracks.", body = Tracks))
)]
pub(super) async fn camera_tracks(
    State(api): State<Shared>,
    Path(camera): Path<String>,
) -> Result<Json<Tracks>, Problem> {
    check_known(&api, &Owner::Camera(camera.clone())).await?;
    let counter = api.counter.lock();
    let scene = counter.scene_of(&camera);
    let answer = scene.map(|scene| tracks(&counter, scene, Some(&camera)));
    Ok(Json(answer.unwrap_or_default()))
}

/// Get the tracks of a site
#[utoipa::path(
    get, path = "/sites/{site}/tracks", tag = "sites", operation_id = "get_site_tracks",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    params(("site" = String, Path, description = "The name of the site.")),
    responses((status = OK, description = "The current tracks.", body = Tracks))
)]
pub(super) async fn site_tracks(
    State(api): State<Shared>,
    Path(site): Path<String>,
) -> Result<Json<Tracks>, Problem> {
    check_known(&api, &Owner::Site(site.clone())).await?;
    let counter = api.counter.lock();
    let scene = counter.site(&site);
    let answer = scene.map(|scene| tracks(&counter, scene, None));
    Ok(Json(answer.unwrap_or_default()))
}

fn tracks(counter: &Counter, scene: &Scene, camera: Option<&str>) -> Tracks {
    let of_camera = camera.and_then(|name| scene.camera(name));
    let presence = of_camera.map_or(scene.presence(), |(_, camera)| &camera.presence);
    let now_ms = now_ms();
    let is_current = presence
        .last_ms
        .is_some_and(|last_ms| now_ms - last_ms <= counter.longest_gap_ms());
    let is_site = matches!(scene.owner, Owner::Site(_));
    let seen = scene.tracks().filter(|track| match of_camera {
        Some((index, _)) if is_site => track.last_person.camera == index,
        _ => true,
    });
    let snapshot = camera.and_then(|name| {
        let mut cameras = counter.snapshot(now_ms).cameras.into_iter();
        cameras.find(|camera| camera.name == name)
    });
    let (lines, zones) = snapshot
        .map(|camera| (camera.lines, camera.zones))
        .unwrap_or_default();
    Tracks {
        last_report: presence.last_ms.map(time_of),
        tracks: seen
            .filter(|_| is_current)
            .map(|track| row(track, of_camera.map(|(_, camera)| camera)))
            .collect(),
        is_current,
        lines: of_camera.map_or_else(Vec::new, |(_, camera)| line_rows(camera, &lines)),
        zones: of_camera.map_or_else(Vec::new, |(_, camera)| zone_rows(camera, &zones)),
        furniture: camera.map_or_else(Vec::new, |camera| things(scene, camera)),
        floor_alerts: of_camera
            .filter(|_| counter.floor_alert_after_ms().is_some())
            .map_or_else(Vec::new, |(_, camera)| {
                camera.floor.alerts().map(PersonOnFloor::from).collect()
            }),
    }
}

/// Returns the lines with their totals and their places in the frame.
fn line_rows(camera: &SceneCamera, totals: &[LineSnapshot]) -> Vec<LineRow> {
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
        let crossings = of_line
            .map(|total| (total.direction.clone(), total.crossings))
            .collect();
        let outline = outline.into_iter().flatten();
        let outline: Vec<_> = outline.map(|point| rounded([point.x, point.y])).collect();
        LineRow {
            line: line.name.clone(),
            directions: line.directions.clone(),
            crossings,
            outline_px: outline,
        }
    });
    rows.collect()
}

/// Returns the zones with their persons and their outlines in the frame.
fn zone_rows(camera: &SceneCamera, current: &[ZoneSnapshot]) -> Vec<ZoneRow> {
    let Some(geometry) = &camera.definition.geometry else {
        return Vec::new();
    };
    let rows = current.iter().map(|zone| {
        let mut drawn = geometry.areas.zones.iter();
        let drawn = drawn.find(|drawn| drawn.name == zone.zone);
        let outline = drawn.map(|zone| {
            let outline = zone
                .area
                .outline(&geometry.lens, &geometry.mount, OUTLINE_SEGMENTS);
            let seen = outline.into_iter().flatten();
            seen.map(|point| rounded([point.x, point.y]))
                .collect::<Vec<_>>()
        });
        ZoneRow {
            zone: zone.zone.clone(),
            persons: zone.persons,
            entries: zone.entries,
            outline_px: outline,
        }
    });
    rows.collect()
}

/// Returns a track, with its places in the frame of `camera`.
fn row(track: &Track, camera: Option<&SceneCamera>) -> TrackRow {
    let floor_m = track.place(Plane::FloorM);
    let plane = if floor_m.is_some() {
        Plane::FloorM
    } else {
        Plane::FramePx
    };
    let since = track.seen_s - TAIL_S;
    let recent = track.tail().filter(|point| point.at_s >= since);
    let recent: Vec<&TailPoint> = recent.collect();
    let tail = recent.iter().filter_map(|point| point.place(plane));
    // A pixel of the track may be one of another camera of the site, a place on the floor is not.
    let in_frame = |camera: &SceneCamera, floor_m: Option<[f64; 2]>, pixel: Option<[f64; 2]>| {
        floor_m.map_or(pixel, |floor_m| camera.definition.pixel_of(floor_m))
    };
    let tail_px = camera.map(|camera| {
        let pixels = recent
            .iter()
            .filter_map(|point| in_frame(camera, point.floor_m, Some(point.foot_px)));
        pixels.map(rounded).collect()
    });
    TrackRow {
        id: track.id.0,
        posture: track.posture().0.name(),
        posture_probability: (track.posture().1 * 100.0).round() / 100.0,
        first_seen: time_of(milliseconds(track.first_seen_s)),
        last_seen: time_of(milliseconds(track.seen_s)),
        floor_m: floor_m.map(rounded),
        velocity_m_s: track.velocity_m_s().map(rounded),
        frame_px: camera
            .and_then(|camera| in_frame(camera, floor_m, track.place(Plane::FramePx)))
            .map(rounded),
        tail: tail.map(rounded).collect(),
        tail_px,
    }
}
