//! The small JSON bodies of these requests.

use axum::body::{Body, to_bytes};
use serde::{Deserialize, de::DeserializeOwned};
use tokio::time::timeout;
use utoipa::ToSchema;

use crate::api::{
    ApiState,
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

/// Reads a body; an empty one stands for the default.
pub(super) async fn read<T: DeserializeOwned + Default>(
    state: &ApiState,
    body: Body,
) -> Result<T, Problem> {
    let bytes = timeout(state.options.request_timeout, to_bytes(body, MAX_BYTES)).await;
    let bytes = bytes.map_err(|_| {
        Problem::new(
            ProblemKind::SlowUpload,
            "the body did not arrive: send it, or none",
        )
    })?;
    let bytes = bytes.map_err(|_| {
        let detail = format!("the body has more than {MAX_BYTES} bytes or was cut off");
        Problem::new(ProblemKind::MalformedRequest, detail)
    })?;
    if bytes.is_empty() {
        return Ok(T::default());
    }
    serde_json::from_slice(&bytes).map_err(|error| {
        Problem::new(
            ProblemKind::MalformedRequest,
            format!("the body cannot be used: {error}"),
        )
    })
}
