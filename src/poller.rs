//! A thread that runs a task every few seconds until it is dropped.

use std::{
    io,
    num::NonZeroU64,
    sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel},
    thread,
    time::Duration,
};

/// A named thread that runs a task. Dropping it ends the thread after the current run, and does not
/// wait for that: a run may take as long as a store or a server does not answer.
pub struct Poller {
    /// Dropping it ends the thread.
    _alive: SyncSender<()>,
}

impl Poller {
    /// Starts the thread, which runs `task` at this interval.
    ///
    /// # Errors
    /// If the operating system creates no thread.
    pub fn start(
        name: &str,
        seconds: NonZeroU64,
        task: impl Fn() + Send + 'static,
    ) -> io::Result<Self> {
        let (alive, ended) = sync_channel::<()>(0);
        let pause = Duration::from_secs(seconds.get());
        thread::Builder::new()
            .name(name.to_owned())
            .spawn(move || {
                while ended.recv_timeout(pause) == Err(RecvTimeoutError::Timeout) {
                    task();
                }
            })?;
        Ok(Self { _alive: alive })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dropping_a_poller_does_not_wait_for_a_stuck_run() {
        let (done, stuck) = sync_channel::<()>(0);
        let (start, started) = sync_channel(0);
        let poller = Poller::start("stuck", NonZeroU64::MIN, move || {
            // Both ends are there until the end of the test.
            let _ = start.send(());
            let _ = stuck.recv();
        });
        started.recv().unwrap();
        drop(poller.unwrap());
        drop(done);
    }
}
