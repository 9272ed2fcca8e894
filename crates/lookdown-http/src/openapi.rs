//! The parts of an OpenAPI document that every HTTP API has: keys and failures.

mod failures;
mod security;

use utoipa::openapi::OpenApi;

pub use security::Keys;

/// Adds the failures, and the operations that need no key, to the document of the routes.
pub fn complete(document: &mut OpenApi) {
    failures::describe(document);
    security::state_public_operations(document);
}
