//! The small JSON bodies of model repository requests.

use axum::extract::{FromRequest, Request};
use serde::{Deserialize, de::DeserializeOwned};
use serde_json::{Map, Value};
use utoipa::ToSchema;

use crate::api::{
    ApiState,
    http::{
        context::RequestContext,
        problem::{Problem, ProblemKind},
    },
};

/// Longest body, bytes.
const MAX_BYTES: usize = 1 << 16;

/// Options of the list of models.
#[derive(Default, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub(in crate::api) struct IndexRequest {
    /// Lists only loaded models.
    pub(super) ready: bool,
}

/// Options of a load. There are none: the manifest of the model defines everything.
#[derive(Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::api) struct LoadRequest {}

/// Options of an unload.
#[derive(Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::api) struct UnloadRequest {
    #[expect(dead_code, reason = "clients send it, but it has no effect")]
    parameters: Option<UnloadParameters>,
}

/// Parameters of an unload.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct UnloadParameters {
    /// Has no effect: no model depends on another.
    #[expect(dead_code, reason = "clients send it, but it has no effect")]
    unload_dependents: Option<bool>,
}

/// A JSON body. An empty body and `null` mean the default.
pub(in crate::api) struct SmallBody<T>(pub(super) T);

impl<T: DeserializeOwned + Default> FromRequest<ApiState> for SmallBody<T> {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &ApiState) -> Result<Self, Problem> {
        let (parts, body) = request.into_parts();
        let context = RequestContext::of(&parts.extensions)?;
        let remedy = "send a shorter body";
        let reader = state.body_reader(&context, MAX_BYTES, remedy);
        let bytes = reader.read(&parts.headers, body).await?.into_bytes();
        if bytes.is_empty() {
            return Ok(Self(T::default()));
        }
        // serde also deserializes structs from arrays.
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
