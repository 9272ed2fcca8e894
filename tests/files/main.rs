//! Files that a server reads: settings, models and calibrations in buckets.
#![expect(clippy::unwrap_used, reason = "a panic fails the test")]

mod buckets;
mod models;
mod settings;
mod upgrade;
