//! The calibration that was found for a camera without one.

use axum::{
    Json,
    extract::{Path, State},
    http::header::CACHE_CONTROL,
    response::IntoResponse,
};
use lookdown_calibration::native::NativeCalibration;
use lookdown_lens::self_calibration::CameraHeight;
use serde::Serialize;
use utoipa::ToSchema;

use crate::{
    api::{
        ApiState,
        http::problem::{Problem, ProblemKind},
        require_scope::RequireRead,
        routes::found_lens::FoundLens,
    },
    rounding::pixels,
    suggestions::{FRAMES, Suggestion},
};

/// The state of a suggestion.
#[derive(Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum SuggestionState {
    /// Not enough frames or people yet.
    Waiting,
    /// There is a calibration to store.
    Found,
    /// The frames or the people do not determine the camera.
    Refused,
}

impl SuggestionState {
    pub(super) fn new(found: &Suggestion) -> Self {
        let is_refused = match &found.fit {
            Some(fit) => fit.is_err(),
            None => matches!(found.height, Some(Err(_))),
        };
        match &found.calibration {
            Some(_) => Self::Found,
            None if is_refused => Self::Refused,
            None => Self::Waiting,
        }
    }
}

/// A reason for not having a value.
#[derive(Serialize, ToSchema)]
struct Refusal {
    /// The kind: `too_few_edges`, `no_directions`, `missing_direction`, `vertical_unclear`,
    /// `ambiguous`, `uncertain`, `halves_disagree`, `frame_disagrees`, `contradicted`,
    /// `no_such_lens`, and `too_few_people` or `uncertain` for the
    /// height.
    #[schema(example = "too_few_edges")]
    reason: &'static str,
    /// The reason with its remedy.
    detail: String,
}

/// The height that was found.
#[derive(Serialize, ToSchema)]
struct FoundHeight {
    /// Meters above the floor.
    #[schema(example = 2.84)]
    height_m: f64,
    /// Its standard deviation, meters.
    #[schema(example = 0.12)]
    height_sd_m: f64,
    /// The number of measured people; the same person in several frames counts several times.
    people: usize,
    /// Angle between the vertical of the camera and that by the same people, degrees: a check of
    /// the level. `null` if they do not determine it.
    level_difference_deg: Option<f64>,
    /// Its standard deviation, degrees.
    level_difference_sd_deg: Option<f64>,
}

/// The calibration that was found for a camera without one, or without a height.
#[derive(Serialize, ToSchema)]
pub(in crate::api) struct SuggestedCalibration {
    state: SuggestionState,
    /// The number of frames of the lens so far.
    frames: usize,
    /// The number of frames, of an hour, after which the lens is not changed any more.
    frames_wanted: usize,
    /// The calibration in the native format, to store with `PUT /calibrations/{id}`. Its `sources`
    /// have the standard deviations.
    #[schema(value_type = Option<Object>)]
    calibration: Option<NativeCalibration>,
    /// The revision that it replaces, for `If-Match`; without one, it is new (`If-None-Match: *`).
    replaces: Option<String>,
    /// The lens.
    lens: Option<FoundLens>,
    /// The reason why there is no lens.
    lens_refusal: Option<Refusal>,
    /// The height of the camera.
    height: Option<FoundHeight>,
    /// The reason why there is no height.
    height_refusal: Option<Refusal>,
}

/// Get the suggested calibration
///
/// The server fits a named camera without a calibration to the edges of five of its frames, and
/// finds its height from its people. Nothing is stored. A camera whose calibration has a height has
/// no suggestion.
#[utoipa::path(
    get, path = "/cameras/{camera}/suggested-calibration", tag = "cameras",
    operation_id = "get_suggested_calibration",
    params(("camera" = String, Path, description = "The name of the camera.", example = "hall")),
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses((status = OK, description = "The findings so far.", body = SuggestedCalibration))
)]
pub(in crate::api) async fn get(
    State(state): State<ApiState>,
    _reader: RequireRead,
    Path(camera): Path<String>,
) -> Result<impl IntoResponse, Problem> {
    let found = state.suggestions.for_camera(&camera).ok_or_else(|| {
        let detail = "no named frame of this camera has arrived since the start, or its calibration \
                      has all values: GET /calibrations lists them";
        Problem::new(ProblemKind::NotFound, detail)
    })?;
    let no_store = [(CACHE_CONTROL, "no-store")];
    Ok((no_store, Json(SuggestedCalibration::from(found))))
}

impl From<Suggestion> for SuggestedCalibration {
    fn from(found: Suggestion) -> Self {
        let state = SuggestionState::new(&found);
        let (lens, lens_refusal) = split(
            found.fit,
            |fit| FoundLens::from(&fit),
            |refusal| Refusal::new(refusal.reason(), &refusal),
        );
        let (height, height_refusal) = split(found.height, FoundHeight::from, |refusal| {
            Refusal::new(refusal.reason(), &refusal)
        });
        Self {
            state,
            frames: found.frames,
            frames_wanted: FRAMES,
            calibration: found.calibration,
            replaces: found.replaces,
            lens,
            lens_refusal,
            height,
            height_refusal,
        }
    }
}

/// Separates a value from the reason for not having it.
fn split<V, R, A, B>(
    found: Option<Result<V, R>>,
    value: impl FnOnce(V) -> A,
    refusal: impl FnOnce(R) -> B,
) -> (Option<A>, Option<B>) {
    match found {
        Some(Ok(found)) => (Some(value(found)), None),
        Some(Err(refused)) => (None, Some(refusal(refused))),
        None => (None, None),
    }
}

impl From<CameraHeight> for FoundHeight {
    fn from(height: CameraHeight) -> Self {
        Self {
            height_m: pixels(height.height_m),
            height_sd_m: pixels(height.sd_m),
            people: height.people,
            level_difference_deg: height.level.map(|level| pixels(level.difference_deg)),
            level_difference_sd_deg: height.level.map(|level| pixels(level.sd_deg)),
        }
    }
}

impl Refusal {
    fn new(reason: &'static str, refusal: &impl ToString) -> Self {
        Self {
            reason,
            detail: refusal.to_string(),
        }
    }
}
