//! Known answers: results of independent implementations, read from `tests/fixtures`.
#![expect(clippy::unwrap_used, reason = "a panic fails the test")]

mod annotation_formats;
mod average_precision;
mod calibration_formats;
mod detection;
mod evaluation;
mod heads;
mod imaging;
mod lenses;
mod views;
