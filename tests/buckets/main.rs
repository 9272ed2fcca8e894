//! Calibrations in a bucket, on a real S3 server (moto, from `requirements.txt`).
#![expect(clippy::unwrap_used, reason = "a test stops at the first surprise")]

mod s3_server;
mod service;
mod serving;
mod store;
