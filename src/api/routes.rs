//! The native API: one module for each resource. No route depends on another or on a protocol.

pub(super) mod calibrations;
pub(super) mod detect;
pub(super) mod health;
pub(super) mod openapi;
pub(super) mod problems;
pub(super) mod results;
pub(super) mod web_page;
