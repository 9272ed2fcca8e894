//! Calibrations in a bucket, on a real S3 server (moto, from `requirements.txt`).
#![expect(clippy::unwrap_used, reason = "a panic fails the test")]

mod s3_server;
mod service;
mod serving;
mod store;
