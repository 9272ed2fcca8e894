//! A thread that looks at the files of loaded models every few seconds.

use std::{
    io,
    num::NonZeroU64,
    sync::{
        Arc,
        mpsc::{RecvTimeoutError, SyncSender, sync_channel},
    },
    thread::{self, JoinHandle},
    time::Duration,
};

use super::ModelRepository;

/// Reloads models when their files change, until it is dropped.
pub struct ModelWatcher {
    /// Its end ends the thread.
    alive: Option<SyncSender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl ModelWatcher {
    /// Starts the thread; it looks every so many seconds.
    ///
    /// # Errors
    /// When the operating system gives no thread.
    pub fn start(repository: Arc<ModelRepository>, seconds: NonZeroU64) -> io::Result<Self> {
        let (alive, ended) = sync_channel::<()>(0);
        let pause = Duration::from_secs(seconds.get());
        let thread = thread::Builder::new()
            .name("model-watcher".to_owned())
            .spawn(move || {
                while ended.recv_timeout(pause) == Err(RecvTimeoutError::Timeout) {
                    repository.reload_changed();
                }
            })?;
        Ok(Self {
            alive: Some(alive),
            thread: Some(thread),
        })
    }
}

impl Drop for ModelWatcher {
    fn drop(&mut self) {
        drop(self.alive.take());
        if let Some(thread) = self.thread.take() {
            // A watcher that panicked has nothing left to tell.
            let _ = thread.join();
        }
    }
}
