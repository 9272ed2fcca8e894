//! Models with the real runtime: small ones made for these tests, and those of `make setup`.

mod custom_models;
mod darknet;
mod families;
pub(crate) mod folder;
mod lifecycle;
mod manifest_keys;
mod refusals;
mod shipped;
mod swap;
