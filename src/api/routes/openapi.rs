//! The OpenAPI document of the server.

use axum::{Extension, Json};
use utoipa::openapi::OpenApi;

/// Builds the OpenAPI document of all routes.
#[derive(Clone, Copy)]
pub(in crate::api) struct DocumentSource(pub(in crate::api) fn() -> OpenApi);

/// Get the OpenAPI document
#[utoipa::path(
    get, path = "/openapi.json", tag = "operation", operation_id = "get_openapi",
    responses((status = OK, description = "OpenAPI 3.1.", body = Object))
)]
pub(in crate::api) async fn openapi_json(
    Extension(DocumentSource(document)): Extension<DocumentSource>,
) -> Json<OpenApi> {
    Json(document())
}
