//! Calibrations in a bucket, on a real S3 server (moto, from `requirements.txt`).

mod hostile;
mod s3_server;
mod service;
mod serving;
mod store;
