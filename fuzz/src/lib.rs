//! What is done with fuzzed bytes: the same functions for the fuzzers of `fuzz_targets/`, which
//! make up the bytes, and for `tests/fuzz_corpus.rs`, which replays what they have found.
//!
//! Each panics when something is wrong, and tells whether its bytes got as far as what it is for.

pub mod importer;
pub mod merge;
pub mod picture;
pub mod request;
pub mod settings;
