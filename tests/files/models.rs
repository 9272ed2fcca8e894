//! Models with the real runtime: small ones made for these tests, and those of `make setup`.

mod custom_models;
mod darknet;
mod folder;
mod lifecycle;
mod refusals;
mod shipped;
mod swap;
