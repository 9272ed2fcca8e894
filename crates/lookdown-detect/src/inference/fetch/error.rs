//! The error of a fetch.

use std::{io, path::PathBuf};

/// The reason why weights were not fetched.
#[derive(Debug, thiserror::Error)]
pub enum FetchError {
    /// The manifest has no sum to compare with.
    #[error(
        "{name}: its model.toml has no sha256, so a file cannot be verified: enter the SHA-256 of \
         the file that you trust"
    )]
    NoSum {
        /// The model.
        name: String,
    },
    /// The source does not have the file.
    #[error("{place} cannot be read ({problem})")]
    Unreadable {
        /// The file or address.
        place: String,
        /// The cause.
        problem: String,
    },
    /// The file is another one.
    #[error(
        "{place} has the SHA-256 {found}, not {wanted} as in the model's model.toml: fetch the \
         file for this version of Lookdown"
    )]
    WrongSum {
        /// The file or address.
        place: String,
        /// The sum of the file.
        found: String,
        /// The pinned sum.
        wanted: String,
    },
    /// No sum of the published file is known, and none was accepted.
    #[error(
        "{place} has the SHA-256 {found}, and the model's model.toml has no sum to compare with"
    )]
    UnknownSum {
        /// The file or address.
        place: String,
        /// The sum of the file.
        found: String,
    },
    /// The file is not the accepted one.
    #[error("{place} has the SHA-256 {found}, not the accepted {accepted}")]
    NotAccepted {
        /// The file or address.
        place: String,
        /// The sum of the file.
        found: String,
        /// The accepted sum.
        accepted: String,
    },
    /// The archive does not have the ONNX file.
    #[error(
        "{place} is not a usable archive: {problem}; correct upstream in the model's model.toml"
    )]
    Archive {
        /// The file or address.
        place: String,
        /// The cause.
        problem: String,
    },
    /// The published file is not a usable network.
    #[error("{place} cannot be installed: {problem}")]
    Unusable {
        /// The file or address.
        place: String,
        /// The mismatch.
        problem: String,
    },
    /// The file is too large.
    #[error("{place} has more than {limit} bytes")]
    TooLarge {
        /// The file or address.
        place: String,
        /// The largest length, bytes.
        limit: u64,
    },
    /// The file cannot be written.
    #[error("{} cannot be written: {source}", path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
}
