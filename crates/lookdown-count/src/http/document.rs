//! The OpenAPI document of the counts.

use lookdown_http::{
    openapi::{Keys, complete},
    problem::ProblemBody,
};
use utoipa::{OpenApi, openapi};

use super::counts::ZoneCounts;

#[derive(OpenApi)]
#[openapi(
    info(
        title = "Counts of Lookdown",
        description = "Counts people over time: lines, zones, tracks and heat maps. `lookdown count` has \
                       these routes on an address of its own, `lookdown run` and a server with \
                       `counts.url` on the address of the server, for keys with the scope `read`. Every \
                       failure is a problem document (RFC 9457).",
        contact(name = "The Lookdown authors")
    ),
    servers((url = "/", description = "This server")),
    tags(
        (name = "counts", description = "Cameras."),
        (name = "sites", description = "Cameras that share a floor."),
        (name = "operation", description = "Health checks, metrics and documentation of the address of `lookdown count`."),
    ),
    components(schemas(ProblemBody, ZoneCounts)),
    modifiers(&Keys)
)]
struct Common;

/// Returns the document of these routes.
pub(super) fn merged(routes: impl IntoIterator<Item = openapi::OpenApi>) -> openapi::OpenApi {
    let mut document = Common::openapi();
    for part in routes {
        document.merge(part);
    }
    complete(&mut document);
    document
}
