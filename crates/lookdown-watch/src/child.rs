//! Child processes: all are started here, with limits.
//!
//! The limits are set from outside as soon as the process exists. Streams are untrusted: a decoder
//! that one of them makes grow ends with an error of its own, and the source is started again.

use std::{
    collections::BTreeMap,
    ffi::OsStr,
    io,
    sync::OnceLock,
    time::{Duration, Instant},
};

use parking_lot::Mutex;
use rustix::process::{Pid, Resource, Rlimit, prlimit, setpriority_process};
use tokio::process::{Child, Command};

use crate::SourceError;

/// Most memory of a decoder. H.264 of 12 megapixels with 16 reference frames takes half of it.
const DECODER_MEMORY: u64 = 1 << 30;
/// Most memory of an encoder of annotated videos.
const ENCODER_MEMORY: u64 = 2 << 30;
/// Most open files.
const MAX_FILES: u64 = 64;
/// The priority below that of this process and of the server.
const NICE: i32 = 5;
/// The prefixes of variables that are of this process alone: settings of the server and of a
/// camera, which may be secret, and those of the allocator, which would return each buffer of a
/// decoder to the system.
const OWN_VARIABLES: [&str; 2] = ["LOOKDOWN_", "MALLOC_"];

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
        let text = name.to_string_lossy();
        if OWN_VARIABLES.iter().any(|prefix| text.starts_with(prefix)) {
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

/// Interval of the checks.
pub(crate) const USAGE_INTERVAL: Duration = Duration::from_secs(1);
/// Time over which the CPU time is averaged.
const WINDOW: Duration = Duration::from_secs(10);
/// Most cores that a decoder of a stream may use on average. It has one thread for each stage.
const MAX_CORES: f64 = 2.0;
/// Ticks of a second in `/proc` (`proc_pid_stat(5)`); Linux has the same number on all machines.
const TICKS: f64 = 100.0;
/// The bytes of a page in `/proc`.
static PAGE: OnceLock<u64> = OnceLock::new();

/// The resident bytes of each child.
static RESIDENT: Mutex<BTreeMap<u32, u64>> = Mutex::new(BTreeMap::new());

/// The usage of one child, removed with it.
#[derive(Debug)]
pub(crate) struct Usage {
    pid: u32,
    since: Instant,
    cpu_seconds: f64,
}

impl Usage {
    /// Starts to observe a child.
    pub(crate) fn for_process(pid: u32) -> Self {
        Self {
            pid,
            since: Instant::now(),
            cpu_seconds: 0.0,
        }
    }

    /// Checks the usage of a child.
    ///
    /// # Errors
    /// [`SourceError`] if all children together take more than half of the machine's memory, and
    /// this one the most of it, or if it uses more CPU time than a decoder needs.
    pub(crate) fn check(&mut self) -> Result<(), SourceError> {
        // A child that has ended has no files.
        let Some((resident, cpu_seconds)) = read(self.pid) else {
            return Ok(());
        };
        if is_largest_beyond(&mut RESIDENT.lock(), self.pid, resident, half_of_memory()) {
            return Err(SourceError::DecoderMemory);
        }
        let elapsed = self.since.elapsed();
        if elapsed >= WINDOW {
            let cores = (cpu_seconds - self.cpu_seconds) / elapsed.as_secs_f64();
            if cores > MAX_CORES {
                return Err(SourceError::DecoderTime(cores));
            }
            self.since = Instant::now();
            self.cpu_seconds = cpu_seconds;
        }
        Ok(())
    }
}

impl Drop for Usage {
    fn drop(&mut self) {
        RESIDENT.lock().remove(&self.pid);
    }
}

/// Notes the memory of a child. Returns true if all children exceed the limit, and this one has
/// most.
fn is_largest_beyond(all: &mut BTreeMap<u32, u64>, pid: u32, resident: u64, limit: u64) -> bool {
    all.insert(pid, resident);
    let sum: u64 = all.values().sum();
    sum > limit && all.values().all(|&other| other <= resident)
}

fn half_of_memory() -> u64 {
    let memory = rustix::system::sysinfo();
    #[expect(clippy::useless_conversion, reason = "the type depends on the machine")]
    let bytes = u64::from(memory.totalram).saturating_mul(u64::from(memory.mem_unit));
    bytes / 2
}

/// Returns the resident bytes and the CPU seconds of a process.
fn read(pid: u32) -> Option<(u64, f64)> {
    let stat = lookdown_common::files::read(format!("/proc/{pid}/stat").as_ref(), 4096).ok()?;
    let stat = String::from_utf8_lossy(&stat).into_owned();
    // The name before the bracket may contain spaces.
    let (_, fields) = stat.rsplit_once(')')?;
    let fields: Vec<_> = fields.split_whitespace().collect();
    let field = |index: usize| fields.get(index)?.parse::<u32>().ok();
    // Fields 14 and 15 (user and system time) and 24 (resident pages), counted from 1, after two.
    let ticks = f64::from(field(11)?) + f64::from(field(12)?);
    let page = *PAGE.get_or_init(|| rustix::param::page_size() as u64);
    Some((u64::from(field(21)?) * page, ticks / TICKS))
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

    #[test]
    fn only_the_largest_child_ends_when_all_exceed_the_budget() {
        let mut all = BTreeMap::new();
        assert!(!is_largest_beyond(&mut all, 1, 60, 100));
        assert!(!is_largest_beyond(&mut all, 2, 50, 100));
        assert!(is_largest_beyond(&mut all, 1, 60, 100));
        all.remove(&1);
        assert!(!is_largest_beyond(&mut all, 2, 50, 100));
    }

    #[test]
    fn a_decoder_that_uses_more_cores_than_it_needs_ends() {
        let cpu_seconds = read(std::process::id()).unwrap().1;
        let usage = |cpu_seconds| Usage {
            pid: std::process::id(),
            since: Instant::now().checked_sub(WINDOW).unwrap(),
            cpu_seconds,
        };
        assert!(usage(cpu_seconds).check().is_ok());
        let busy = usage(cpu_seconds - 1.1 * MAX_CORES * WINDOW.as_secs_f64()).check();
        assert!(matches!(busy, Err(SourceError::DecoderTime(cores)) if cores > MAX_CORES));
    }

    #[test]
    fn a_running_process_has_memory_and_time() {
        let (resident, seconds) = read(std::process::id()).unwrap();
        assert!(resident > 1 << 20 && seconds >= 0.0);
        assert_eq!(read(u32::MAX), None);
    }
}
