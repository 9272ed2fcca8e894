//! The repository: its converter, documentation, documented variables, layers, OpenAPI document,
//! the libraries' API, the fuzzing corpus and the workflows.
#![expect(clippy::unwrap_used, reason = "a panic fails the test")]

mod converter;
mod documentation;
mod fuzz_corpus;
mod layering;
mod links;
mod openapi;
mod restricted_calls;
mod variables;
mod workflows;
