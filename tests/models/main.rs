//! Models with the real runtime: small ones made for these tests, and those of `make setup`.
#![expect(clippy::unwrap_used, reason = "a failed call fails the test")]

mod custom_models;
mod darknet;
mod folder;
mod lifecycle;
mod refusals;
mod shipped;
mod swap;
