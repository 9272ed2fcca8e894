//! The repository: its documentation, documented variables, layers, OpenAPI document, the libraries'
//! API and the fuzzing corpus.
#![expect(clippy::unwrap_used, reason = "a panic fails the test")]

mod documentation;
mod fuzz_corpus;
mod layering;
mod links;
mod openapi;
mod restricted_calls;
mod variables;
