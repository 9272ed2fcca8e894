//! The followed number of a camera, handed back by `lookdown count`.

use axum::{
    extract::{FromRequest, Request, State},
    http::StatusCode,
};
use jiff::Timestamp;
use serde::Deserialize;
use utoipa::ToSchema;

use super::{address::CameraAddress, unknown};
use crate::{
    api::{
        ApiState,
        http::{
            context::RequestContext,
            problem::{Problem, ProblemKind},
        },
        require_scope::RequireDetect,
    },
    results::FollowedNumber,
};

/// Most bytes of a body.
const MAX_BYTES: usize = 1024;
/// Most followed persons.
const MAX_PERSONS: usize = 100_000;

/// The number of followed persons.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::api) struct FollowedPersons {
    /// Number of persons that are followed now.
    #[schema(minimum = 0, maximum = 100_000, example = 5)]
    persons: usize,
}

impl FromRequest<ApiState> for FollowedPersons {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &ApiState) -> Result<Self, Problem> {
        let (parts, body) = request.into_parts();
        let context = RequestContext::from_extensions(&parts.extensions)?;
        let remedy = "send an object such as {\"persons\": 5}";
        let reader = state.body_reader(&context, MAX_BYTES, remedy);
        let bytes = reader.read(&parts.headers, body).await?.into_bytes();
        let sent: Self = serde_json::from_slice(&bytes).map_err(|error| {
            Problem::new(
                ProblemKind::InvalidParameter,
                format!("the body: {error}: {remedy}"),
            )
        })?;
        if sent.persons > MAX_PERSONS {
            let detail = format!("persons is {}: give at most {MAX_PERSONS}", sent.persons);
            return Err(Problem::new(ProblemKind::InvalidParameter, detail));
        }
        Ok(sent)
    }
}

/// Set the followed persons
///
/// `lookdown count` hands back the number of persons that it follows. For 15 s, it is the number of
/// the camera in `GET /results`, metrics, MQTT and the page.
#[utoipa::path(
    put, path = "/results/{camera}/followed", tag = "results", operation_id = "put_followed",
    params(("camera" = String, Path, description = "The name of the camera.", example = "lobby")),
    request_body = FollowedPersons,
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses((status = NO_CONTENT, description = "The number is stored."))
)]
pub(in crate::api) async fn put(
    State(state): State<ApiState>,
    _detect: RequireDetect,
    CameraAddress(camera): CameraAddress,
    sent: FollowedPersons,
) -> Result<StatusCode, Problem> {
    let number = FollowedNumber {
        persons: sent.persons,
        at: Timestamp::now(),
    };
    if state.results.follow(&camera, number).await? {
        Ok(StatusCode::NO_CONTENT)
    } else {
        Err(unknown(&camera))
    }
}
