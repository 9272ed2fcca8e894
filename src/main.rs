//! The `lookdown` binary.

use std::{
    env,
    os::unix::process::CommandExt,
    process::{Command, ExitCode},
};

/// The variables that libraries read when they are loaded, and their values unless they are set: no
/// telemetry of ONNX Runtime, and a malloc (glibc) that returns freed memory of this many bytes, so
/// that the limits on memory hold for the process and not for its live objects only.
const DEFAULTS: [(&str, &str); 2] = [
    ("ORT_DISABLE_TELEMETRY", "1"),
    ("MALLOC_MMAP_THRESHOLD_", "131072"),
];

fn main() -> ExitCode {
    let is_unset = |(name, _): &(&str, &str)| env::var_os(name).is_none();
    let missing: Vec<_> = DEFAULTS.into_iter().filter(is_unset).collect();
    if !missing.is_empty() {
        let mut arguments = env::args_os();
        // Setting a variable in a process is not memory-safe, so the process is replaced by itself.
        // If that fails, as without /proc, the program runs with the variables it has. The path,
        // not `/proc/self/exe`, keeps the name of the process.
        let _ = Command::new(env::current_exe().unwrap_or_default())
            .arg0(arguments.next().unwrap_or_default())
            .args(arguments)
            .envs(missing)
            .exec();
    }
    // `make dist` sets the commit. A source tarball has none.
    lookdown::cli::run(env::args_os(), option_env!("LOOKDOWN_COMMIT"))
}
