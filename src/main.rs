//! The `lookdown` binary.

use std::{
    env,
    os::unix::process::CommandExt,
    process::{Command, ExitCode},
};

/// The variable that disables the telemetry of ONNX Runtime, which reads it when it is loaded.
const NO_TELEMETRY: &str = "ORT_DISABLE_TELEMETRY";

fn main() -> ExitCode {
    if env::var_os(NO_TELEMETRY).is_none() {
        let mut arguments = env::args_os();
        // Setting a variable in a process is not memory-safe, so the process is replaced by itself.
        // If that fails, as without /proc, the program runs with the variables it has. The path, not
        // `/proc/self/exe`, keeps the name of the process.
        let _ = Command::new(env::current_exe().unwrap_or_default())
            .arg0(arguments.next().unwrap_or_default())
            .args(arguments)
            .env(NO_TELEMETRY, "1")
            .exec();
    }
    // `make dist` sets the commit. A source tarball has none.
    lookdown::cli::run(env::args_os(), option_env!("LOOKDOWN_COMMIT"))
}
