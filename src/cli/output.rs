//! Errors of writes to standard output.

use std::io;

/// The error of a write to standard output.
pub(super) const UNWRITABLE: &str = "standard output cannot be written";

/// Returns true if the program that reads standard output has ended, such as `head`.
pub(super) fn is_closed_pipe(error: &anyhow::Error) -> bool {
    let mut causes = error.chain();
    let is_output = causes.any(|cause| cause.to_string() == UNWRITABLE);
    let mut causes = error
        .chain()
        .filter_map(|cause| cause.downcast_ref::<io::Error>());
    is_output && causes.any(|cause| cause.kind() == io::ErrorKind::BrokenPipe)
}
