//! The parts of an OpenAPI document that every HTTP API has: keys and failures.

use utoipa::{
    Modify, PartialSchema, ToSchema,
    openapi::{
        Content, Header, HeaderBuilder, OpenApi, Ref, RefOr, Response, ResponseBuilder, Schema,
        path::{Operation, PathItem},
        security::{
            ApiKey, ApiKeyValue, HttpAuthScheme, HttpBuilder, SecurityRequirement, SecurityScheme,
        },
    },
};

use crate::problem::ProblemBody;

/// Adds the failures, and the operations that need no key, to the document of the routes.
pub fn complete(document: &mut OpenApi) {
    describe_failures(document);
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

/// The name of the response among the document's components.
const NAME: &str = "Problem";
/// The statuses of failures.
const STATUSES: [&str; 2] = ["4XX", "5XX"];

/// Adds the failures to every operation of the document.
pub(super) fn describe_failures(document: &mut OpenApi) {
    let components = document.components.get_or_insert_default();
    components
        .responses
        .insert(NAME.to_owned(), response().into());
    for operation in document.paths.paths.values_mut().flat_map(operations) {
        for status in STATUSES {
            let responses = &mut operation.responses.responses;
            responses.insert(status.to_owned(), Ref::from_response_name(NAME).into());
        }
    }
}

pub(super) fn operations(path: &mut PathItem) -> impl Iterator<Item = &mut Operation> {
    let operations = [
        &mut path.get,
        &mut path.put,
        &mut path.post,
        &mut path.delete,
        &mut path.patch,
    ];
    operations.into_iter().flatten()
}

fn response() -> Response {
    let schema = Ref::from_schema_name(ProblemBody::name());
    let description = "A problem document (RFC 9457). `GET /problems` lists all values of `type`.";
    ResponseBuilder::new()
        .description(description)
        .content("application/problem+json", Content::new(Some(schema)))
        .header(
            "Retry-After",
            header(
                u32::schema(),
                "Seconds to wait before a retry, where a retry helps (429, 503).",
            ),
        )
        .header(
            "WWW-Authenticate",
            header(String::schema(), "`Bearer` (401)."),
        )
        .header(
            "RateLimit-Policy",
            header(String::schema(), "The rate limit, if there is one."),
        )
        .header(
            "RateLimit",
            header(
                String::schema(),
                "The requests left, if there is a rate limit.",
            ),
        )
        .build()
}

fn header(schema: RefOr<Schema>, description: &str) -> Header {
    HeaderBuilder::new()
        .schema(Some(schema))
        .description(Some(description))
        .build()
}
