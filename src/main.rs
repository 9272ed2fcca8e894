//! The `lookdown` binary.

use std::process::ExitCode;

fn main() -> ExitCode {
    // `make dist` sets the commit. A source tarball has none.
    lookdown::cli::run(std::env::args_os(), option_env!("LOOKDOWN_COMMIT"))
}
