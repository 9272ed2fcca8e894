//! The asynchronous runtimes of commands.

use std::{process::ExitCode, time::Duration};

use anyhow::Context;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use tokio::runtime::{Builder, Runtime};

/// Threads of `run`, `watch` and `count` for sockets, cameras, counts and JSON. Frames have
/// separate threads.
pub(super) const THREADS: usize = 2;
/// Longest time that the end of the process waits for tasks that block. They may take as long as
/// workers that are stuck, and a read of standard input may never end.
const LAST_TASKS: Duration = Duration::from_secs(1);

const NO_THREAD: &str = "the operating system creates no thread";

/// Runs work on a runtime with this number of threads, and ends the tasks that remain. The process
/// may open as many files as its hard limit permits.
pub(super) fn run_async(
    threads: usize,
    work: impl Future<Output = anyhow::Result<()>>,
) -> anyhow::Result<ExitCode> {
    raise_limit_of_open_files();
    let mut builder = Builder::new_multi_thread();
    let runtime = builder.worker_threads(threads).enable_all().build();
    let runtime = runtime.context(NO_THREAD)?;
    let outcome = runtime.block_on(work);
    end(runtime);
    outcome.map(|()| ExitCode::SUCCESS)
}

/// Raises the soft limit of open files, often 1024, to the hard one: every connection is a file. A
/// system that refuses leaves the limit as it is.
fn raise_limit_of_open_files() {
    let limit = getrlimit(Resource::Nofile);
    let _ = setrlimit(
        Resource::Nofile,
        Rlimit {
            current: limit.maximum,
            ..limit
        },
    );
}

/// Creates a runtime on the current thread.
pub(super) fn for_this_thread() -> anyhow::Result<Runtime> {
    let runtime = Builder::new_current_thread().enable_all().build();
    runtime.context(NO_THREAD)
}

/// Ends the tasks that remain.
pub(super) fn end(runtime: Runtime) {
    runtime.shutdown_timeout(LAST_TASKS);
}

#[cfg(test)]
mod tests {
    use std::{sync::mpsc::sync_channel, time::Instant};

    use super::*;

    #[test]
    fn a_stuck_task_delays_the_end_by_at_most_3_s() {
        let runtime = Builder::new_multi_thread().build().unwrap();
        let (done, stuck) = sync_channel::<()>(0);
        runtime.spawn_blocking(move || stuck.recv());
        let began = Instant::now();
        end(runtime);
        assert!(began.elapsed() < Duration::from_secs(3));
        drop(done);
    }
}
