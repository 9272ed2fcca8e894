//! The functions under fuzzing, for the fuzzers of `fuzz_targets/`, which generate bytes, and for
//! `tests/repository/fuzz_seeds.rs`, which replays their seeds.
//!
//! Each function panics on an error, and returns true if its bytes reached the code under test.

pub mod image_file;
pub mod importer;
pub mod merge;
pub mod request;
pub mod settings;
