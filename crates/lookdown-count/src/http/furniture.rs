//! The furniture of a camera: what stands at one place for hours and is not counted.

use axum::{
    Json,
    extract::{Path, State},
    http::StatusCode,
};
use lookdown_common::text::one_line;
use lookdown_http::problem::Problem;
use lookdown_lens::geometry::Pixel;
use lookdown_tracking::furniture::{Furniture, Thing as Stored, ThingState};
use nalgebra::Vector2;
use serde::Serialize;
use utoipa::ToSchema;

use super::shared::{Shared, check_known, not_found, rounded};
use crate::{definition::CameraDefinition, scene::Scene, sums::Owner};

/// Observed presence from which a candidate is listed, seconds.
const LISTED_AFTER_S: f64 = 60.0;

/// The state of a thing.
#[derive(Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
enum StateOfThing {
    /// It counts as a person, and becomes furniture after 7200 s.
    Candidate,
    /// Furniture: it is not counted.
    Remembered,
    /// Furniture that was confirmed.
    Confirmed,
}

/// A thing that stands at one place.
#[derive(Serialize, ToSchema)]
pub(super) struct Thing {
    /// The identifier in paths, unique per camera.
    id: u64,
    state: StateOfThing,
    /// Time that it was seen without a motion.
    present_seconds: f64,
    /// The corners of its box in the frame.
    outline_px: Vec<[f64; 2]>,
}

/// List the furniture of a camera
///
/// Lists what has stood for a minute at one place, and was never seen to arrive or to move. After
/// two hours it is furniture and not counted.
#[utoipa::path(
    get, path = "/cameras/{camera}/furniture", tag = "counts", operation_id = "list_furniture",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    params(("camera" = String, Path, description = "The name of the camera.")),
    responses((status = OK, description = "By identifier.", body = Vec<Thing>))
)]
pub(super) async fn list(
    State(api): State<Shared>,
    Path(camera): Path<String>,
) -> Result<Json<Vec<Thing>>, Problem> {
    check_known(&api, &Owner::Camera(camera.clone())).await?;
    let counter = api.counter.lock();
    let scene = counter.scene_of(&camera);
    Ok(Json(
        scene.map_or_else(Vec::new, |scene| things(scene, &camera)),
    ))
}

/// Confirm furniture
///
/// The thing is not counted from now on, however long it has stood there.
#[utoipa::path(
    put, path = "/cameras/{camera}/furniture/{thing}", tag = "counts", operation_id = "confirm_furniture",
    security((), ("bearer" = ["admin"]), ("api_key" = ["admin"])),
    params(
        ("camera" = String, Path, description = "The name of the camera."),
        ("thing" = u64, Path, description = "The identifier of the thing."),
    ),
    responses((status = NO_CONTENT, description = "The thing is furniture."))
)]
pub(super) async fn confirm(
    State(api): State<Shared>,
    Path((camera, thing)): Path<(String, String)>,
) -> Result<StatusCode, Problem> {
    decide(&api, (&camera, &thing), Furniture::confirm)
}

/// Take furniture back
///
/// The thing counts as a person again, and is not remembered as long as it stays there.
#[utoipa::path(
    delete, path = "/cameras/{camera}/furniture/{thing}", tag = "counts", operation_id = "take_back_furniture",
    security((), ("bearer" = ["admin"]), ("api_key" = ["admin"])),
    params(
        ("camera" = String, Path, description = "The name of the camera."),
        ("thing" = u64, Path, description = "The identifier of the thing."),
    ),
    responses((status = NO_CONTENT, description = "The thing counts as a person."))
)]
pub(super) async fn take_back(
    State(api): State<Shared>,
    Path((camera, thing)): Path<(String, String)>,
) -> Result<StatusCode, Problem> {
    decide(&api, (&camera, &thing), Furniture::take_back)
}

fn decide(
    api: &Shared,
    (camera, thing): (&str, &str),
    decision: fn(&mut Furniture, u64) -> bool,
) -> Result<StatusCode, Problem> {
    let id = thing.parse::<u64>().ok();
    let mut counter = api.counter.lock();
    let decided =
        id.and_then(|id| counter.change_furniture(camera, |furniture| decision(furniture, id)));
    if decided == Some(true) {
        return Ok(StatusCode::NO_CONTENT);
    }
    let [camera, thing] = [camera, thing].map(one_line);
    Err(not_found(format!(
        "{camera} has no furniture {thing}: GET /cameras/{camera}/furniture lists it"
    )))
}

/// Returns the listed things of a camera.
pub(super) fn things(scene: &Scene, camera: &str) -> Vec<Thing> {
    let Some((_, known)) = scene.camera(camera) else {
        return Vec::new();
    };
    let things = scene
        .furniture(camera)
        .into_iter()
        .flat_map(Furniture::things);
    let listed = things.filter(|thing| thing.is_furniture() || thing.present_s >= LISTED_AFTER_S);
    listed
        .filter_map(|thing| row(thing, &known.definition))
        .collect()
}

fn row(thing: &Stored, definition: &CameraDefinition) -> Option<Thing> {
    let state = match thing.state {
        ThingState::Candidate => StateOfThing::Candidate,
        ThingState::Remembered => StateOfThing::Remembered,
        ThingState::Confirmed => StateOfThing::Confirmed,
        ThingState::TakenBack => return None,
    };
    Some(Thing {
        id: thing.id,
        state,
        present_seconds: thing.present_s.round(),
        outline_px: outline(thing, definition),
    })
}

/// Returns the corners of the upright box in the frame.
fn outline(thing: &Stored, definition: &CameraDefinition) -> Vec<[f64; 2]> {
    let [x, y] = thing.center_px();
    let [width, height] = thing.size_px();
    let center = Pixel::new(x, y);
    let up = definition.up_at(center);
    let up = up
        .try_normalize(f64::EPSILON)
        .unwrap_or_else(|| -Vector2::y());
    let right = Vector2::new(-up.y, up.x);
    let corners = [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)].map(|(across, along)| {
        center + right * (across * width / 2.0) + up * (along * height / 2.0)
    });
    corners.map(|corner| rounded([corner.x, corner.y])).to_vec()
}
