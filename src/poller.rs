//! A thread that runs a task every few seconds until it is dropped.

use std::{
    io,
    num::NonZeroU64,
    sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel},
    thread::{self, JoinHandle},
    time::Duration,
};

/// A named thread that runs a task. Dropping it ends the thread.
pub struct Poller {
    /// Dropping it ends the thread.
    alive: Option<SyncSender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Poller {
    /// Starts the thread, which runs `task` at this interval.
    ///
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
        let thread = thread::Builder::new()
            .name(name.to_owned())
            .spawn(move || {
                while ended.recv_timeout(pause) == Err(RecvTimeoutError::Timeout) {
                    task();
                }
            })?;
        Ok(Self {
            alive: Some(alive),
            thread: Some(thread),
        })
    }
}

impl Drop for Poller {
    fn drop(&mut self) {
        drop(self.alive.take());
        if let Some(thread) = self.thread.take() {
            // The panic of a task was already logged.
            let _ = thread.join();
        }
    }
}
