//! The repository: its converter, documentation, documented variables, layers, OpenAPI document,
//! the libraries' API, the seeds of the fuzzers and the workflows.
#![expect(clippy::unwrap_used, reason = "a panic fails the test")]

mod converter;
mod documentation;
mod fuzz_seeds;
mod layering;
mod links;
mod openapi;
mod restricted_calls;
mod variables;
mod workflows;
