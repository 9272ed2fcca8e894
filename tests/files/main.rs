//! Files that a server reads: settings and models.
#![expect(clippy::unwrap_used, reason = "a panic fails the test")]

mod models;
mod settings;
mod upgrade;
