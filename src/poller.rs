//! A thread that does something every few seconds until nobody needs it any more.

use std::{
    io,
    num::NonZeroU64,
    sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel},
    thread::{self, JoinHandle},
    time::Duration,
};

/// A named thread with a task; its end is the thread's.
pub struct Poller {
    /// Its end ends the thread.
    alive: Option<SyncSender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Poller {
    /// Starts the thread; it does `task` every so many seconds.
    ///
    /// # Errors
    /// When the operating system gives no thread.
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
            // A task that panicked has nothing left to tell.
            let _ = thread.join();
        }
    }
}
