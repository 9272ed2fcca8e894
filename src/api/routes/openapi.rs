//! The OpenAPI document of the server.

use axum::{Json, extract::State};

use crate::api::{ApiState, http::problem::Problem, openapi::Document, openapi_document};

/// Get the OpenAPI document
///
/// It has the routes of the counts if this server has counts.
#[utoipa::path(
    get, path = "/openapi.json", tag = "operation", operation_id = "get_openapi",
    responses((status = OK, description = "OpenAPI 3.1.", body = Object))
)]
pub(in crate::api) async fn openapi_json(
    State(state): State<ApiState>,
) -> Result<Json<Document>, Problem> {
    let document = openapi_document(state.options.companions.counts_document());
    document.map(Json).map_err(Problem::internal)
}
