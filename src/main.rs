//! The `lookdown` binary.

use std::process::ExitCode;

fn main() -> ExitCode {
    lookdown::cli::run()
}
