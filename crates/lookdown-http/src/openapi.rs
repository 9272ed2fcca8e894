//! The parts of an OpenAPI document that every HTTP API has: keys and failures.

mod failures;

use utoipa::{
    Modify,
    openapi::{
        OpenApi,
        security::{
            ApiKey, ApiKeyValue, HttpAuthScheme, HttpBuilder, SecurityRequirement, SecurityScheme,
        },
    },
};

use failures::operations;

/// Adds the failures, and the operations that need no key, to the document of the routes.
pub fn complete(document: &mut OpenApi) {
    failures::describe(document);
    state_public_operations(document);
}

/// The two ways to send a key.
#[derive(Debug, Clone, Copy)]
pub struct Keys;

impl Modify for Keys {
    fn modify(&self, document: &mut OpenApi) {
        let description = "An API key. A server without configured keys does not require one.";
        let bearer = HttpBuilder::new()
            .scheme(HttpAuthScheme::Bearer)
            .description(Some(description))
            .build();
        let plain = ApiKeyValue::with_description("X-API-Key", description);
        let components = document.components.get_or_insert_default();
        components.add_security_scheme("bearer", SecurityScheme::Http(bearer));
        components.add_security_scheme("api_key", SecurityScheme::ApiKey(ApiKey::Header(plain)));
    }
}

/// States that the operations without a required key need none.
fn state_public_operations(document: &mut OpenApi) {
    for operation in document.paths.paths.values_mut().flat_map(operations) {
        let no_key = || vec![SecurityRequirement::default()];
        operation.security.get_or_insert_with(no_key);
    }
}
