//! The people on the floor of a camera, and the acknowledgment of their alerts.

use axum::{
    Json,
    extract::{Path, State},
    http::StatusCode,
};
use jiff::Timestamp;
use lookdown_common::text::one_line;
use lookdown_http::problem::Problem;
use serde::Serialize;
use utoipa::ToSchema;

use super::shared::{Shared, check_known, not_found, rounded};
use crate::{floor::PersonDown, now::time_of, sums::Owner};

/// The people on the floor of a camera.
#[derive(Serialize, ToSchema)]
pub(super) struct OnFloor {
    /// False if `counts.floor_alert` is off.
    is_on: bool,
    persons: Vec<PersonOnFloor>,
}

/// A person who lies, outside of zones where lying is expected.
#[derive(Serialize, ToSchema)]
pub(super) struct PersonOnFloor {
    /// The identifier in paths, unique per camera.
    id: u64,
    /// `lying`, or `unknown`.
    posture: &'static str,
    /// Since when the person is down.
    since: Timestamp,
    /// Time of the last frame that showed the person.
    last_seen: Timestamp,
    /// The zone that holds the person, or one nearby.
    zone: Option<String>,
    /// Center of the last box, in the frame.
    center_px: [f64; 2],
    /// True once it has lasted for `counts.floor_alert_after`.
    is_alert: bool,
    is_acknowledged: bool,
}

impl From<&PersonDown> for PersonOnFloor {
    fn from(person: &PersonDown) -> Self {
        Self {
            id: person.id,
            posture: person.posture.name(),
            since: time_of(person.since_ms),
            last_seen: time_of(person.seen_ms),
            zone: person.zone.clone(),
            center_px: rounded(person.center_px),
            is_alert: person.is_alert,
            is_acknowledged: person.is_acknowledged,
        }
    }
}

/// List people on the floor
///
/// Lists who lies outside of zones with `lying` = `expected`, and since when. Not a
/// medical device: docs/count.md has its limits.
#[utoipa::path(
    get, path = "/counts/{camera}/floor", tag = "counts", operation_id = "list_people_on_floor",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    params(("camera" = String, Path, description = "The name of the camera.")),
    responses((status = OK, description = "Longest first.", body = OnFloor))
)]
pub(super) async fn list(
    State(api): State<Shared>,
    Path(camera): Path<String>,
) -> Result<Json<OnFloor>, Problem> {
    check_known(&api, &Owner::Camera(camera.clone())).await?;
    let counter = api.counter.lock();
    let scene = counter.scene_of(&camera);
    let known = scene.and_then(|scene| Some(&scene.camera(&camera)?.1.floor));
    let persons = known.map_or(&[][..], |floor| &floor.persons);
    Ok(Json(OnFloor {
        is_on: counter.floor_alert_after_ms().is_some(),
        persons: persons.iter().map(PersonOnFloor::from).collect(),
    }))
}

/// Acknowledge a floor alert
///
/// The alert stays listed until the person is up. Its metric becomes 0, and its frame on the page
/// disappears.
#[utoipa::path(
    put, path = "/counts/{camera}/floor/{person}", tag = "counts", operation_id = "acknowledge_floor_alert",
    security((), ("bearer" = ["admin"]), ("api_key" = ["admin"])),
    params(
        ("camera" = String, Path, description = "The name of the camera."),
        ("person" = u64, Path, description = "The identifier of the person."),
    ),
    responses((status = NO_CONTENT, description = "The alert is acknowledged."))
)]
pub(super) async fn acknowledge(
    State(api): State<Shared>,
    Path((camera, person)): Path<(String, String)>,
) -> Result<StatusCode, Problem> {
    let id = person.parse::<u64>().ok();
    let mut counter = api.counter.lock();
    if id.and_then(|id| counter.acknowledge(&camera, id)) == Some(true) {
        return Ok(StatusCode::NO_CONTENT);
    }
    let [camera, person] = [camera, person].map(|name| one_line(&name));
    Err(not_found(format!(
        "{camera} has no floor alert {person}: GET /counts/{camera}/floor lists them"
    )))
}
