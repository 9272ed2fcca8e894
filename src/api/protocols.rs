//! APIs that other programs defined, for their clients. No protocol depends on a route or on
//! another protocol.

pub(super) mod deepstack;
pub(super) mod open_inference;
