//! The `lookdown` binary.

use std::process::ExitCode;

fn main() -> ExitCode {
    // `make dist` sets the commit. A source tarball has none.
    lookdown::cli::run(option_env!("LOOKDOWN_COMMIT"))
}
