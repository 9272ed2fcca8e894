//! Child processes: all are started here, with limits.
//!
//! The limits are set from outside as soon as the process exists. Streams are untrusted: a decoder
//! that one of them makes grow ends with an error of its own, and the source is started again.

pub(crate) mod usage;

use std::{ffi::OsStr, io};

use rustix::process::{Pid, Resource, Rlimit, prlimit, setpriority_process};
use tokio::process::{Child, Command};

/// Most memory of a decoder. H.264 of 12 megapixels with 16 reference frames takes half of it.
const DECODER_MEMORY: u64 = 1 << 30;
/// Most memory of an encoder of annotated videos.
const ENCODER_MEMORY: u64 = 2 << 30;
/// Most open files.
const MAX_FILES: u64 = 64;
/// The priority below that of this process and of the server.
const NICE: i32 = 5;
/// The prefix of variables with settings of the server and of a camera, which may be secret.
const SECRET_VARIABLES: &str = "LOOKDOWN_";

/// The task of a child process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Task {
    /// Reads a video and writes to a pipe.
    Decode,
    /// Writes a file.
    Encode,
}

/// Returns a command whose process ends with its handle and has no settings of the server.
pub(crate) fn command(program: impl AsRef<OsStr>) -> Command {
    let mut command = Command::new(program);
    command.kill_on_drop(true);
    for (name, _) in std::env::vars_os() {
        if name.to_string_lossy().starts_with(SECRET_VARIABLES) {
            command.env_remove(name);
        }
    }
    command
}

/// Starts a process with the limits of its task.
///
/// # Errors
/// If the process cannot be started or limited.
pub(crate) fn spawn(command: &mut Command, task: Task) -> io::Result<Child> {
    let child = command.spawn()?;
    // A child that has ended needs no limits.
    if let Some(pid) = child.id().and_then(|id| Pid::from_raw(id.try_into().ok()?)) {
        limit(pid, task)?;
    }
    Ok(child)
}

fn limit(pid: Pid, task: Task) -> io::Result<()> {
    let set = |resource, most| {
        let limit = Rlimit {
            current: Some(most),
            maximum: Some(most),
        };
        prlimit(Some(pid), resource, limit).map(drop)
    };
    let memory = match task {
        Task::Decode => DECODER_MEMORY,
        Task::Encode => ENCODER_MEMORY,
    };
    // Private memory, not address space: drivers of hardware decoders map much more.
    set(Resource::Data, memory)?;
    set(Resource::Nofile, MAX_FILES)?;
    set(Resource::Core, 0)?;
    if task == Task::Decode {
        set(Resource::Fsize, 0)?;
    }
    setpriority_process(Some(pid), NICE)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::process::Stdio;

    use super::*;

    #[tokio::test]
    async fn limits_apply_to_the_running_process() {
        let mut command = command("sh");
        // The shell waits for its standard input, so the limits are set before it reads them.
        command
            .args(["-c", "read line; cat /proc/self/limits; nice; env"])
            .env("LOOKDOWN__X__PASSWORD", "secret")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped());
        command.env_remove("LOOKDOWN__X__PASSWORD");
        let child = spawn(&mut command, Task::Decode).unwrap();
        let output = child.wait_with_output().await.unwrap();
        let shown = String::from_utf8(output.stdout).unwrap();
        let limit = |name: &str| {
            let line = shown.lines().find(|line| line.starts_with(name)).unwrap();
            line.split_whitespace().nth(3).unwrap().to_owned()
        };
        assert_eq!(limit("Max data size"), "1073741824");
        assert_eq!(limit("Max open files"), "64");
        assert_eq!(limit("Max file size"), "0");
        assert!(!shown.contains("secret"), "{shown}");
    }

    #[tokio::test]
    async fn a_child_that_grows_beyond_its_memory_fails() {
        let mut command = command("sh");
        // A buffer of 1.5 GiB, which is taken when standard input ends: after the limits are set.
        command
            .args([
                "-c",
                "read line; exec dd if=/dev/zero of=/dev/null bs=1610612736 count=1",
            ])
            .stdin(Stdio::piped())
            .stderr(Stdio::null());
        let mut child = spawn(&mut command, Task::Decode).unwrap();
        drop(child.stdin.take());
        assert!(!child.wait().await.unwrap().success());
    }
}
