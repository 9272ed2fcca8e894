//! The native API: one module for each resource. No route depends on another or on a protocol. A
//! new endpoint needs its handler and a row of the table here.

pub(super) mod calibrations;
pub(super) mod cameras;
pub(super) mod counts;
mod found_lens;
pub(super) mod health;
pub(super) mod problems;
pub(super) mod results;
pub(super) mod web_page;

use utoipa::OpenApi as _;
use utoipa_axum::{router::OpenApiRouter, routes};

use super::{ApiState, detect};

/// Returns the routes of clients, with their entries in the OpenAPI document.
pub(super) fn client_routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new()
        .routes(routes!(detect::route::detect_persons))
        .routes(routes!(calibrations::list))
        .routes(routes!(
            calibrations::get,
            calibrations::put,
            calibrations::delete
        ))
        .routes(routes!(
            calibrations::views::get_views,
            calibrations::views::try_views
        ))
        .routes(routes!(calibrations::fit))
        .routes(routes!(cameras::list))
        .routes(routes!(
            cameras::get,
            cameras::put,
            cameras::patch,
            cameras::delete
        ))
        .routes(routes!(cameras::test))
        .routes(routes!(cameras::get_frame))
        .routes(routes!(cameras::suggestion::get))
        .routes(routes!(cameras::views::list))
        .routes(routes!(
            cameras::views::get,
            cameras::views::put,
            cameras::views::delete
        ))
        .merge(OpenApiRouter::with_openapi(
            cameras::views::ImageRoutes::openapi(),
        ))
        .routes(routes!(cameras::reference_counts::list))
        .routes(routes!(
            cameras::reference_counts::put,
            cameras::reference_counts::delete
        ))
        .routes(routes!(results::list))
        .routes(routes!(results::delete))
        .routes(routes!(results::get_latest))
        .routes(routes!(results::get_latest_image))
        .routes(routes!(results::get_history))
        .routes(routes!(results::events::camera_events))
        .routes(routes!(results::events::all_events))
}
