//! The OpenAPI document of the server.

use axum::{Extension, Json};

use crate::api::{http::problem::Problem, openapi::Document};

/// Builds the OpenAPI document of all routes.
#[derive(Clone, Copy)]
pub(in crate::api) struct DocumentSource(pub(in crate::api) fn() -> serde_json::Result<Document>);

/// Get the OpenAPI document
#[utoipa::path(
    get, path = "/openapi.json", tag = "operation", operation_id = "get_openapi",
    responses((status = OK, description = "OpenAPI 3.1.", body = Object))
)]
pub(in crate::api) async fn openapi_json(
    Extension(DocumentSource(document)): Extension<DocumentSource>,
) -> Result<Json<Document>, Problem> {
    document().map(Json).map_err(Problem::internal)
}
