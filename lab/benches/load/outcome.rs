//! The outcome of one request.

use hyper::StatusCode;

/// The outcome of a request.
pub enum Outcome {
    /// The complete response, with its number of bytes.
    Answered(StatusCode, usize),
    /// No connection, or a broken one.
    Broken,
    /// The response timed out.
    TimedOut,
}
