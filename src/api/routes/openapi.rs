//! The OpenAPI document of the server.

use axum::{Extension, Json, extract::State};

use utoipa::openapi::OpenApi;

use crate::api::{ApiState, http::problem::Problem, openapi::Document};

/// Builds the OpenAPI document of all routes, with those of the counts if their document is given.
#[derive(Clone, Copy)]
pub(in crate::api) struct DocumentSource(
    pub(in crate::api) fn(Option<OpenApi>) -> serde_json::Result<Document>,
);

/// Get the OpenAPI document
///
/// It has the routes of the counts if this server has counts.
#[utoipa::path(
    get, path = "/openapi.json", tag = "operation", operation_id = "get_openapi",
    responses((status = OK, description = "OpenAPI 3.1.", body = Object))
)]
pub(in crate::api) async fn openapi_json(
    State(state): State<ApiState>,
    Extension(DocumentSource(document)): Extension<DocumentSource>,
) -> Result<Json<Document>, Problem> {
    document(state.options.companions.counts_document())
        .map(Json)
        .map_err(Problem::internal)
}
