//! The small JSON bodies of these requests.

use axum::extract::{FromRequest, Request};
use serde::{Deserialize, de::DeserializeOwned};
use serde_json::{Map, Value};
use utoipa::ToSchema;

use crate::api::{
    ApiState,
    deadline::Deadline,
    problem::{Problem, ProblemKind},
};

/// Longest body, bytes.
const MAX_BYTES: usize = 1 << 16;

/// Which models to list.
#[derive(Default, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub(in crate::api) struct IndexRequest {
    /// Leave out those that do not answer.
    pub(super) ready: bool,
}

/// How to load: there is nothing to choose, as a model's manifest says it all.
#[derive(Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::api) struct LoadRequest {}

/// How to unload.
#[derive(Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::api) struct UnloadRequest {
    #[expect(dead_code, reason = "clients send it, and it asks for nothing")]
    parameters: Option<UnloadParameters>,
}

/// Parameters of an unload.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct UnloadParameters {
    /// Changes nothing: no model depends on another.
    #[expect(dead_code, reason = "clients send it, and it asks for nothing")]
    unload_dependents: Option<bool>,
}

/// A body; an empty one and `null` stand for the default.
pub(in crate::api) struct SmallBody<T>(pub(super) T);

impl<T: DeserializeOwned + Default> FromRequest<ApiState> for SmallBody<T> {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &ApiState) -> Result<Self, Problem> {
        let (parts, body) = request.into_parts();
        let deadline = Deadline::of(&parts, state);
        let reader = state.body_reader(MAX_BYTES, "a few words are enough", deadline);
        let bytes = reader.read(&parts.headers, body).await?.into_bytes();
        if bytes.is_empty() {
            return Ok(Self(T::default()));
        }
        // Structs would be read from arrays as well.
        let fields: Result<Option<Map<String, Value>>, _> = serde_json::from_slice(&bytes);
        let read =
            fields.and_then(|fields| T::deserialize(Value::Object(fields.unwrap_or_default())));
        read.map(Self).map_err(|error| {
            Problem::new(
                ProblemKind::MalformedRequest,
                format!("the body cannot be used: {error}"),
            )
        })
    }
}
