//! The `lookdown` binary.

use std::process::ExitCode;

fn main() -> ExitCode {
    // Whoever builds from a checkout may state it, as `make dist` does; a source tarball has none.
    lookdown::cli::run(option_env!("LOOKDOWN_COMMIT"))
}
