//! The Open Inference Protocol (KServe V2) over HTTP, with tensors as JSON or as bytes behind it (the
//! extension `binary_tensor_data`). Source: the protocol's repository `open-inference-protocol`, and the
//! extensions as Triton Inference Server describes them.
//!
//! The model `lookdown` takes a frame and answers with the persons in it; every detector that is loaded
//! takes views and answers with what it finds in each.

mod answer;
mod detector;
pub(super) mod document;
mod metadata;
mod persons;
mod request;
mod request_head;
mod tensor;
mod wanted;

use std::sync::Arc;

use axum::{
    Extension, Json,
    extract::{Path, State},
    response::IntoResponse,
};

use super::{
    ApiState, Phase,
    access::Finder,
    openapi::{InferProblems, ModelProblems, ModelReadyProblems, NotReadyProblems, RawBytes},
    problem::{Problem, ProblemKind},
    request_id::RequestId,
    upload::Arrival,
};
use crate::{inference::Model, telemetry::RequestTrace};
use answer::InferAnswer;
use document::{InferRequestBody, InferResponseBody};
use metadata::{ModelMetadata, ModelReady, ServerLive, ServerMetadata, ServerReady};
use request::InferRequest;

/// The model that finds the persons in frames.
pub(super) const FRAME_MODEL: &str = "lookdown";
/// The version of its inputs and outputs.
const FRAME_MODEL_VERSION: &str = "1";

/// A model that can be asked.
enum Asked {
    Frames,
    Views(Arc<Model>),
}

impl Asked {
    /// The model of that name, and of that version, if one is named.
    fn find(state: &ApiState, name: &str, version: Option<&str>) -> Result<Self, Problem> {
        let unknown = |detail| Problem::new(ProblemKind::UnknownModel, detail);
        let found = if name == FRAME_MODEL {
            Self::Frames
        } else {
            let model = state.models.registry().get(name);
            Self::Views(model.ok_or_else(|| {
                let loaded = state.models.registry().all();
                let loaded: Vec<_> = loaded.iter().map(|model| model.name()).collect();
                let (name, loaded) = (shown(name), loaded.join(", "));
                unknown(format!(
                    "model: {name:?} is not there; there are {FRAME_MODEL}, which takes frames, and \
                     the detectors that are loaded: {loaded}"
                ))
            })?)
        };
        match version {
            Some(wanted) if wanted != found.version() => {
                let (wanted, version) = (shown(wanted), found.version());
                Err(unknown(format!(
                    "model: {name} has the version {version}, and no {wanted:?}"
                )))
            }
            _ => Ok(found),
        }
    }

    fn version(&self) -> &str {
        match self {
            Self::Frames => FRAME_MODEL_VERSION,
            Self::Views(model) => model.revision(),
        }
    }

    fn metadata(&self) -> ModelMetadata {
        match self {
            Self::Frames => persons::metadata(),
            Self::Views(model) => detector::metadata(model),
        }
    }
}

/// As much of a text as helps its sender.
fn shown(text: &str) -> String {
    text.chars().take(64).collect()
}

/// What is this server?
#[utoipa::path(
    get, path = "/v2", tag = "operation", operation_id = "get_server_metadata",
    responses((status = OK, description = "Its name, version and extensions.", body = ServerMetadata))
)]
pub(super) async fn server() -> Json<ServerMetadata> {
    Json(ServerMetadata::default())
}

/// Is the process alive? As `/livez`, for clients of the Open Inference Protocol.
#[utoipa::path(
    get, path = "/v2/health/live", tag = "operation", operation_id = "get_server_liveness",
    responses((status = OK, description = "The process answers.", body = ServerLive))
)]
pub(super) async fn live() -> Json<ServerLive> {
    Json(ServerLive { live: true })
}

/// Can frames be sent? As `/readyz`, for clients of the Open Inference Protocol.
#[utoipa::path(
    get, path = "/v2/health/ready", tag = "operation", operation_id = "get_server_readiness",
    responses(
        (status = OK, description = "Frames can be sent.", body = ServerReady),
        NotReadyProblems
    )
)]
pub(super) async fn ready(State(state): State<ApiState>) -> Result<Json<ServerReady>, Problem> {
    require_ready(&state)?;
    Ok(Json(ServerReady { ready: true }))
}

fn require_ready(state: &ApiState) -> Result<(), Problem> {
    match state.readiness.phase() {
        Phase::Ready => Ok(()),
        Phase::WarmingUp => Err(Problem::warming_up()),
        Phase::Stopping => Err(Problem::shutting_down()),
    }
}

/// What does a model take and answer?
///
/// `lookdown` takes a frame and answers with persons; the detectors take views.
#[utoipa::path(
    get, path = "/v2/models/{name}", tag = "inference", operation_id = "get_model",
    params(("name" = String, Path, description = "`lookdown`, or the name of a detector.")),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "Its inputs and outputs.", body = ModelMetadata),
        ModelProblems,
    )
)]
pub(super) async fn model(
    State(state): State<ApiState>,
    _finder: Finder,
    Path(name): Path<String>,
) -> Result<Json<ModelMetadata>, Problem> {
    Ok(Json(Asked::find(&state, &name, None)?.metadata()))
}

/// What does this version of a model take and answer?
#[utoipa::path(
    get, path = "/v2/models/{name}/versions/{version}", tag = "inference",
    operation_id = "get_model_version",
    params(
        ("name" = String, Path, description = "`lookdown`, or the name of a detector."),
        ("version" = String, Path, description = "Its one version, as its metadata tells it."),
    ),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "Its inputs and outputs.", body = ModelMetadata),
        ModelProblems,
    )
)]
pub(super) async fn model_version(
    State(state): State<ApiState>,
    _finder: Finder,
    Path((name, version)): Path<(String, String)>,
) -> Result<Json<ModelMetadata>, Problem> {
    Ok(Json(Asked::find(&state, &name, Some(&version))?.metadata()))
}

/// Can a model be asked?
#[utoipa::path(
    get, path = "/v2/models/{name}/ready", tag = "inference", operation_id = "get_model_readiness",
    params(("name" = String, Path, description = "`lookdown`, or the name of a detector.")),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "It can.", body = ModelReady),
        ModelReadyProblems,
    )
)]
pub(super) async fn model_ready(
    State(state): State<ApiState>,
    _finder: Finder,
    Path(name): Path<String>,
) -> Result<Json<ModelReady>, Problem> {
    Asked::find(&state, &name, None)?;
    require_ready(&state)?;
    Ok(Json(ModelReady { name, ready: true }))
}

/// Can this version of a model be asked?
#[utoipa::path(
    get, path = "/v2/models/{name}/versions/{version}/ready", tag = "inference",
    operation_id = "get_model_version_readiness",
    params(
        ("name" = String, Path, description = "`lookdown`, or the name of a detector."),
        ("version" = String, Path, description = "Its one version, as its metadata tells it."),
    ),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "It can.", body = ModelReady),
        ModelReadyProblems,
    )
)]
pub(super) async fn model_version_ready(
    State(state): State<ApiState>,
    _finder: Finder,
    Path((name, version)): Path<(String, String)>,
) -> Result<Json<ModelReady>, Problem> {
    Asked::find(&state, &name, Some(&version))?;
    require_ready(&state)?;
    Ok(Json(ModelReady { name, ready: true }))
}

/// Find persons as clients of the Open Inference Protocol ask.
///
/// `lookdown` takes `image` (`BYTES`, `[1]`): an encoded frame, base64 in JSON, as it is behind it. It
/// answers with `boxes` (`[persons, 4]`), `scores`, `oriented_boxes` (`[persons, 5]`), `views` and
/// `report`; the parameters of `/detect` are parameters of the request. A detector takes `views` (`FP32` or
/// `UINT8`, `[views, 3, height, width]`, pixels 0 to 255) and answers with `boxes`
/// (`[views, candidates, 4]`) and `scores` (`[views, candidates]`), filled up with zeros.
#[utoipa::path(
    post, path = "/v2/models/{name}/infer", tag = "inference", operation_id = "infer_with_model",
    params(
        ("name" = String, Path, description = "`lookdown`, or the name of a detector."),
        ("Inference-Header-Content-Length" = Option<u32>, Header,
         description = "Where tensors follow as bytes: the length of the JSON before them."),
    ),
    request_body(
        description = "JSON, or JSON with the bytes of tensors behind it.",
        content((InferRequestBody = "application/json"), (inline(RawBytes) = "application/octet-stream"))
    ),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "The outputs.",
         content((InferResponseBody = "application/json"), ("application/octet-stream"))),
        InferProblems,
    )
)]
pub(super) async fn infer(
    State(state): State<ApiState>,
    Extension(request_id): Extension<RequestId>,
    Extension(trace): Extension<RequestTrace>,
    Path(name): Path<String>,
    arrival: Arrival,
) -> Result<impl IntoResponse, Problem> {
    let asked = Asked::find(&state, &name, None)?;
    answered(&state, &request_id, &trace, asked, arrival).await
}

/// Find persons with this version of a model.
///
/// As without a version.
#[utoipa::path(
    post, path = "/v2/models/{name}/versions/{version}/infer", tag = "inference",
    operation_id = "infer_with_model_version",
    params(
        ("name" = String, Path, description = "`lookdown`, or the name of a detector."),
        ("version" = String, Path, description = "Its one version, as its metadata tells it."),
        ("Inference-Header-Content-Length" = Option<u32>, Header,
         description = "Where tensors follow as bytes: the length of the JSON before them."),
    ),
    request_body(
        description = "JSON, or JSON with the bytes of tensors behind it.",
        content((InferRequestBody = "application/json"), (inline(RawBytes) = "application/octet-stream"))
    ),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "The outputs.",
         content((InferResponseBody = "application/json"), ("application/octet-stream"))),
        InferProblems,
    )
)]
pub(super) async fn infer_version(
    State(state): State<ApiState>,
    Extension(request_id): Extension<RequestId>,
    Extension(trace): Extension<RequestTrace>,
    Path((name, version)): Path<(String, String)>,
    arrival: Arrival,
) -> Result<impl IntoResponse, Problem> {
    let asked = Asked::find(&state, &name, Some(&version))?;
    answered(&state, &request_id, &trace, asked, arrival).await
}

async fn answered(
    state: &ApiState,
    request_id: &RequestId,
    trace: &RequestTrace,
    asked: Asked,
    arrival: Arrival,
) -> Result<InferAnswer, Problem> {
    trace.stage(
        "upload",
        arrival.deadline.began().into_std(),
        arrival.arrived,
    );
    let (headers, body) = (arrival.parts.headers, arrival.body.into_bytes());
    let read = move || InferRequest::read(&headers, &body);
    let read = arrival.deadline.blocking(read).await?;
    let times = (arrival.deadline, arrival.received_at, arrival.arrived);
    match asked {
        Asked::Frames => persons::infer(state, request_id, trace, read, times).await,
        Asked::Views(model) => detector::infer(state, trace, model, read, times).await,
    }
}
