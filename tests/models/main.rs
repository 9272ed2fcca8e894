//! Models through the real run-time: tiny ones made for these tests, and those of the set-up.
#![expect(clippy::unwrap_used, reason = "a test stops at the first surprise")]

mod brought;
mod darknet;
mod folder;
mod lifecycle;
mod refusals;
mod shipped;
mod swap;
